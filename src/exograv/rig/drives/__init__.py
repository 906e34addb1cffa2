"""Real motors: how they are wired, and the buses on which they are spoken to; one `Rig` a bus."""
