"""Injected faults, in simulation first: each with its injector, its detector and its reaction budget."""
