"""Commands for a machine with a wearer."""
