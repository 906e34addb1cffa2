"""Behaviour of acting wearers: anticipation, practice and weakness."""
