"""Start-up self-test: tests that a machine must pass each day before a person may be in it, and their lock."""
