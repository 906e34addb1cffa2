"""Simulated moteus controllers on a virtual bus, for tests without hardware."""
