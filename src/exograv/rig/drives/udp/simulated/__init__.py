"""A simulated controller that speaks the UDP protocol."""
