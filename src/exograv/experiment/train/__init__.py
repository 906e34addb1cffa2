"""Session of a protocol: a participant in the machine touches a target, window after window."""
