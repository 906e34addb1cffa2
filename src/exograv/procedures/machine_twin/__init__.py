"""Twin of a machine from its recordings."""
