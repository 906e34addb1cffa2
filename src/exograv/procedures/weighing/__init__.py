"""What weighs how much: the arm against the table before anything else, and known weights that a person carries."""
