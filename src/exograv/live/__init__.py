"""Processes of a running machine: guard, control, worker, their supervisors, and machines on drives."""
