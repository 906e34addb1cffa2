"""Sources of a study become rows of its tables: our recordings, a CSV of touches, XDF of LabRecorder."""
