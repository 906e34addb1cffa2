"""From motion and torque to the arm's parameters with their uncertainty; one file per method."""
