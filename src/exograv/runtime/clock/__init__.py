"""Real time: the periodic loop, its timing, and the rights of the process."""
