"""From a desired torque to a commanded one that is fit to reach a person."""
