"""Our kernels beside all opponents: one run, the same machines and states, agreement before timing, physical limits."""
