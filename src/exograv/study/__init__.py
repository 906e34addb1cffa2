"""Recordings become findings; runs on any laptop, without the model or the twin."""
