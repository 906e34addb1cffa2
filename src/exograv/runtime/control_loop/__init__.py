"""The guard process, and what it exchanges with control and worker."""
