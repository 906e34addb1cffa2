"""Simulated CANopen drives on a virtual CAN bus, for tests without hardware."""
