"""Commands for many simulated runs."""
