"""Stimulus process: a simulated participant's eyes and fingertip at the real page of a session, in Chromium."""
