"""Rooms that exist only in simulation: the twin with its wearer, and the examiner with access to the twin's truth."""
