"""The processes of a running machine: control, worker, their supervisors, and machines on drives."""
