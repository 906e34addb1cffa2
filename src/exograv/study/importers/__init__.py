"""Importers that turn a study's sources into rows of its tables: our recordings, CSV of touches, XDF of LabRecorder."""
