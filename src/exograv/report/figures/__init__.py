"""Figures of recordings, one file each: drawing, or None without the data for it, and explanation."""
