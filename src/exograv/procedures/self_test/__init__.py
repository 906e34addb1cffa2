"""The start-up self-test: what a machine must show each day before anybody is in it, and the lock that asks for it."""
