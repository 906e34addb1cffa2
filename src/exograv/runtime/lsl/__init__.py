"""Lab Streaming Layer: streams that a live run publishes, and streams of other devices that it records."""
