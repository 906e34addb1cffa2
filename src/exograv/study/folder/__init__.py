"""Files in a study's folder: paths, settings, columns, journal."""
