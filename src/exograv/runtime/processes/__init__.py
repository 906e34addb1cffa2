"""Processes and their shared memory."""
