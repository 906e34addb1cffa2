"""Arm models of third parties, MJCF or URDF, that serve as the twin's truth."""
