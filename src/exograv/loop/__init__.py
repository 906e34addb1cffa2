"""One control step on any machine, and what drives it: in lock-step on a virtual clock, live, or replayed."""
