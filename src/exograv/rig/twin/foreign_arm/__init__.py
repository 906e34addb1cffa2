"""Arms of third parties: MJCF or URDF models that serve as the twin's truth."""
