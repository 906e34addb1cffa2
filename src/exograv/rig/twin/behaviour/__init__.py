"""Wearers who act: anticipation, practice and weakness."""
