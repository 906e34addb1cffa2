"""Identification while the wearer works."""
