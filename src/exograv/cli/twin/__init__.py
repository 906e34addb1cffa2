"""Commands for the twin of a machine."""
