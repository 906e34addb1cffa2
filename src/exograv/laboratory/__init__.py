"""Everything that exists only in simulation: the twin with its wearer, and the examiner who sees the truth."""
