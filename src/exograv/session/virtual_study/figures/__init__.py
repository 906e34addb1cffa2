"""Pictures of a virtual study, each marked as simulated."""
