"""Recorder process and its supervisor."""
