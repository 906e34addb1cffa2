"""Rounding of numbers for results."""

from collections.abc import Sequence

import numpy as np

DECIMALS = 4
"""Decimals of numbers in results."""


def rounded(values: np.ndarray) -> list[float]:
    """Return the values rounded to the decimals that results have."""
    return [round(float(value), DECIMALS) for value in values]


def percentiles(tick_us: Sequence[float]) -> dict[str, float]:
    """Percentiles of the duration of ticks [µs]."""
    p50, p99, p999 = np.percentile(tick_us, [50, 99, 99.9])
    return {"p50": round(float(p50), 1), "p99": round(float(p99), 1), "p999": round(float(p999), 1)}
