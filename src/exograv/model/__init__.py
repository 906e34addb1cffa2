"""What is true before anything moves: exoskeleton, arm, anthropometry and how cuffs join the two."""
