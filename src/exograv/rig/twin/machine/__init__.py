"""Machine of the twin: drives, sensors and links with their true errors."""
