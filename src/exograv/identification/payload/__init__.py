"""Identification of a payload on a robot."""
