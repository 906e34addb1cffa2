"""How many people the next study needs, from a pilot or from stated assumptions, by simulation."""
