"""From state, reference and parameters to the torque that is desired."""
