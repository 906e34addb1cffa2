"""Report of a study: figures, tables and sentences from the study's folder, as a page and for print."""
