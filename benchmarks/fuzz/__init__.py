"""Targets of `make fuzz`: each module has the seeds of one reader, and a function that gives it bytes."""
