"""Disturbances of the twin by level, and its random numbers."""
