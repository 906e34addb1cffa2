"""Random numbers of the twin.

Each disturbance has a stream of its own. Switching one disturbance does not change the draws of the others.
"""

import zlib

import numpy as np

from .levels import Value


def stream(seed: int, owner: str, row: str) -> np.random.Generator:
    """Return the generator of one disturbance of one owner ("wearer", "machine", "run").

    The same seed gives the same numbers at every level.
    """
    keys = (zlib.crc32(owner.encode()), zlib.crc32(row.encode()))
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=keys))


def uniform(generator: np.random.Generator, value: Value) -> float:
    """Draw from a range, or return the number itself. Both cases take one number from the generator."""
    low, high = value if isinstance(value, tuple) else (value, value)
    position = generator.random()
    return low if low == high else low + (high - low) * position
