"""Sessions in which support follows what a person reaches, block by block, day by day."""
