"""Techniques with a machine, real or simulated: calibration, identification, weighing, verification, tests."""
