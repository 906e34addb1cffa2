"""The files of a study's folder: places, settings, columns, journal."""
