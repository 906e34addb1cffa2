"""Guided motion: an arm is led by hand, and the machine repeats or mirrors it with limited torque (docs/guided.md)."""
