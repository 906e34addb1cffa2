"""Guided motion: an arm is led, and the machine repeats or mirrors it with limited torque (docs/howto/guided.md)."""
