"""Measures of touches, windows, sessions and people: one catalogue of names, and the computation of each."""
