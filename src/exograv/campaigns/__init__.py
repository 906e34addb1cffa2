"""Thousands of runs: faults, identification benchmark, virtual studies, sweeps."""
