"""Control step for any machine, and the code that drives it: in lock-step on a virtual clock, live, or as a replay."""
