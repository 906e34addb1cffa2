"""A session that a person steers from a page: what may be asked for, who decides, what is shown."""
