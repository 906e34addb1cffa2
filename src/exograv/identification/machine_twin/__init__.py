"""Identification of a machine's twin from recordings of the empty machine."""
