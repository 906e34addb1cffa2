"""A tick in lock-step in C: measurement, guard, control, command and record of one period of a simulated machine."""
