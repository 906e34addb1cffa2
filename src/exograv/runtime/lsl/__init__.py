"""Lab Streaming Layer: what a live run publishes, and what it records of other people's devices."""
