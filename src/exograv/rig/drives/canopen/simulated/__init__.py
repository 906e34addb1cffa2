"""Simulated CANopen drives."""
