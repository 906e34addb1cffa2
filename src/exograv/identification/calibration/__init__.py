"""Identification of the empty machine."""
