"""Weighing: check of the arm's weight against the table at the start, and known weights that a person carries."""
