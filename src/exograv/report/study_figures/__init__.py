"""Figures of a whole study. Each `draw(data)` returns a figure, or None if the study lacks the data for it."""
