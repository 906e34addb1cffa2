"""Guard's tick: one Python source, its translation to C, and the choice between the two."""
