"""Our kernels beside every peer: one run, the same machines and states, agreement before time, and what is possible."""
