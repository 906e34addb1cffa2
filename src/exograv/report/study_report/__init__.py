"""The report of a study: figures, tables and sentences made of its folder, as a page and for print."""
