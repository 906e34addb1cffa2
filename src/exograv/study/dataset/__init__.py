"""A study's folder: who took part, what was recorded, and the tidy tables that findings are made from."""
