"""Who takes part: codes drawn at random, what is told of each in bands, and names in an encrypted file elsewhere."""
