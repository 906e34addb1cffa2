"""Wearer of the twin: body, joints, muscles at rest, and donning."""
