"""A machine of real drives, or of simulated ones in another process, with whoever stands beside it."""
