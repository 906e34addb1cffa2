"""Proof of the guard's promises on its own source, `src/exograv/safety/native/core.py`."""
