"""Control laws: desired torque from state, reference and parameters."""
