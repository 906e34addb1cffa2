"""Teach, repeat and mirror on the twin, with a virtual therapist."""
