"""Driver of `udp.host` in C, for a loop that does not wait for the interpreter."""
