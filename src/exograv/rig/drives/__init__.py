"""Real motors: their wiring, and drivers of their buses; one `Rig` per bus."""
