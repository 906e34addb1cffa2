"""A session of a protocol: somebody in the machine touches a target, window after window."""
