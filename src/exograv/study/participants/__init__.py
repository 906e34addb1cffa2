"""Participants: codes drawn at random, data of each participant in bands, and names in a separate encrypted file."""
