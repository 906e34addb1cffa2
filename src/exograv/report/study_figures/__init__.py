"""Figures of a whole study: each `draw(data)` gives a figure, or None where the study lacks what it shows."""
