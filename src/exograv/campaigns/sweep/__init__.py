"""Many virtual wearers, machines and methods: one list of tasks, run here, by processes, or by a cluster."""
