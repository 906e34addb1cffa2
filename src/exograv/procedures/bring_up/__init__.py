"""A machine is brought up on the bench for the first time: step by step, in the order of danger, nothing skipped."""
