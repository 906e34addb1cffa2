"""Identification methods compared on the same streams: who is how near the truth, when, and how honest about it."""
