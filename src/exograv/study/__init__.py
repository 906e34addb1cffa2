"""Findings from recordings. The room runs on any laptop, without the model or the twin."""
