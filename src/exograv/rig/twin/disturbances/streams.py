"""Random numbers of the twin.

Each disturbance has its own stream, so that switching one leaves the others' draws as they were.
"""

import zlib

import numpy as np

from .levels import Value


def stream(seed: int, owner: str, row: str) -> np.random.Generator:
    """Generator of one disturbance of one owner ("wearer", "machine", "run").

    Same seed, same numbers, at every level.
    """
    keys = (zlib.crc32(owner.encode()), zlib.crc32(row.encode()))
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=keys))


def uniform(generator: np.random.Generator, value: Value) -> float:
    """A draw from a range, or the number itself; either way one number is taken from the generator."""
    low, high = value if isinstance(value, tuple) else (value, value)
    position = generator.random()
    return low if low == high else low + (high - low) * position
