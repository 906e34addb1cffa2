"""Dataset of a study: adding of files, participants' sessions, and the tidy tables from which findings are made."""
