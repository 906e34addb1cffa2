"""Sobol' points: quasi-random points that fill a box evenly. They are SciPy's, whose import takes 0.7 s of CPU."""

import numpy as np
from jaxtyping import Float

BITS = 30
"""Bits of a coordinate; a sequence has up to 2³⁰ points."""

POLYNOMIALS = (1, 3, 7, 11, 13, 19, 25, 37, 41, 47, 55, 59, 61, 67, 91, 97)
FIRST_NUMBERS = (
    (1,), (1,), (1, 3), (1, 3, 1), (1, 1, 1), (1, 1, 3, 3), (1, 3, 5, 13), (1, 1, 5, 5, 17), (1, 1, 5, 5, 5),
    (1, 1, 7, 11, 19), (1, 1, 5, 1, 1), (1, 1, 1, 3, 11), (1, 3, 5, 5, 31), (1, 3, 3, 9, 7, 49),
    (1, 1, 1, 15, 21, 21), (1, 3, 1, 13, 27, 49),
)  # fmt: skip
"""Primitive polynomial and first direction numbers of each dimension.

Source: Joe & Kuo 2008, SIAM J. Sci. Comput. 30:2635, table `new-joe-kuo-6`.
"""

DIMENSIONS_MAX = len(POLYNOMIALS)

Points = Float[np.ndarray, "point dimension"]


def sobol_points(dimensions: int, count: int, scrambling: np.random.Generator | None = None) -> Points:
    """Return the first points of the sequence, between 0 and 1.

    Args:
        dimensions: Number of coordinates, up to `DIMENSIONS_MAX`.
        count: Number of points; powers of two are balanced best.
        scrambling: Generator that draws a random linear scrambling and a shift (Matoušek 1998); without it the first
            point is 0.

    Raises:
        ValueError: The sequence has fewer dimensions or points.
    """
    if not 1 <= dimensions <= DIMENSIONS_MAX or not 0 <= count <= 2**BITS:
        raise ValueError(
            f"{count} Sobol' points of {dimensions} dimensions were asked for; up to {2**BITS} points of 1 to "
            f"{DIMENSIONS_MAX} dimensions exist."
        )
    directions, shift = _directions(dimensions), np.zeros(dimensions, np.uint32)
    if scrambling is not None:
        directions, shift = _scrambled(directions, scrambling)
    # Gray code: each point differs from the one before in the direction of the lowest zero bit of its number.
    steps = np.zeros((max(count, 1), dimensions), np.uint32)
    steps[0] = shift
    numbers = np.arange(max(count - 1, 0))
    lowest_zero = np.log2((~numbers & (numbers + 1)).astype(float)).astype(int)
    steps[1:] = directions[:, lowest_zero].T
    return (np.bitwise_xor.accumulate(steps, axis=0) * 2.0**-BITS)[:count]


def _directions(dimensions: int) -> np.ndarray:
    """Sobol' direction numbers (dimension, bit). Bit 0 is the most significant one."""
    rows = []
    for polynomial, first in zip(POLYNOMIALS[:dimensions], FIRST_NUMBERS, strict=False):
        degree, numbers = polynomial.bit_length() - 1, list(first)
        if degree == 0:
            numbers = [1] * BITS
        while len(numbers) < BITS:
            new = numbers[-degree] ^ (numbers[-degree] << degree)
            for k in range(1, degree):
                if polynomial >> (degree - k) & 1:
                    new ^= numbers[-k] << k
            numbers.append(new)
        rows.append([number << (BITS - 1 - bit) for bit, number in enumerate(numbers)])
    return np.array(rows, np.uint32)


def _scrambled(directions: np.ndarray, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Multiply the bits of each dimension by a random lower triangular matrix, and draw the shift."""
    dimensions, generator = len(directions), generator.spawn(1)[0]  # as SciPy does
    weights = 2 ** np.arange(BITS, dtype=np.uint32)
    shift = generator.integers(2, size=(dimensions, BITS), dtype=np.uint32) @ weights
    lower = np.tril(generator.integers(2, size=(dimensions, BITS, BITS), dtype=np.uint32))
    lower[:, np.arange(BITS), np.arange(BITS)] = 1
    bits = directions[:, :, None] >> np.arange(BITS - 1, -1, -1, dtype=np.uint32) & 1  # (dimension, number, bit)
    mixed = (bits @ lower.transpose(0, 2, 1)) & 1
    return (mixed @ weights[::-1]).astype(np.uint32), shift.astype(np.uint32)
