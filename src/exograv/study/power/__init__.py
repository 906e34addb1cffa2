"""Number of people that the next study needs, simulated from a pilot or from stated assumptions."""
