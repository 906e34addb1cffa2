"""Models of exoskeleton and wearer before any motion: machine, arm, anthropometry, and the cuffs between them."""
