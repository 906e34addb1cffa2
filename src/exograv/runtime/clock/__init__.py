"""Real time: the periodic loop, its timing, and the real-time rights of the process."""
