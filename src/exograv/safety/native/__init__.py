"""Guard's tick: one Python source, its translation to C, and the choice of what runs."""
