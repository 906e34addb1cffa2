"""What goes wrong on purpose, in simulation first: each fault with its injector, its detector and its budget."""
