"""Sweeps over virtual wearers, machines and methods: a list of tasks for this process, several, or a cluster."""
