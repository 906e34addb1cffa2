"""Limits between the desired torque of control and the commanded torque that may reach a person."""
