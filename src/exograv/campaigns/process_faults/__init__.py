"""Matrix of process faults: each process of a live session is struck in each state, and judged from outside."""
