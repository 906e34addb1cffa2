"""Entries of `model.loops.FIT` for the path of a shoulder's centre beside the usual one."""

FURTHER_PATH = (0.002, -0.002, 0.001, 0.0008, -0.0005, 0.001, 0.004, -0.003, 0.002, -0.003, 0.002, 0.004)
"""Displacement up and medially, forward, and up and laterally, per shape of `model.loops.PATH_SHAPES` [m]."""
