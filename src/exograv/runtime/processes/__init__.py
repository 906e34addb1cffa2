"""Processes and the memory that they share."""
