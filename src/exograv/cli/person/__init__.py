"""Commands for a person in the machine."""
