"""Virtual participant, and the simulated screen, panel and flight around it."""
