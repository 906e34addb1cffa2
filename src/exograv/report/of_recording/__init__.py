"""Report of one recording."""
