"""Sessions with assist as needed: support follows the targets that a person reaches, block by block and day by day."""
