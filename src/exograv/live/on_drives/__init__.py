"""Commands on a machine with real drives, or with simulated drives in another process, and its operator."""
