"""Virtual study: simulated people train, fly and are compared, by mechanism. It is no evidence about people."""
