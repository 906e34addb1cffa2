"""Commands for campaigns of many simulated runs."""
