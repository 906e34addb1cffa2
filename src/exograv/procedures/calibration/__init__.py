"""Calibration of the empty machine: breakaway test, sweeps, known weights."""
