"""Simulated controller with the UDP protocol."""
