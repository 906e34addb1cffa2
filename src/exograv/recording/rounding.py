"""Rounding of numbers for results."""

from collections.abc import Mapping

import numpy as np

from .computing_times import ComputingTimes

DECIMALS = 4
"""Decimals of numbers in results."""


def rounded(values: np.ndarray) -> list[float]:
    """Return the values rounded to the decimals that results have."""
    return [round(float(value), DECIMALS) for value in values]


def percentiles(ticks: Mapping[float, int]) -> dict[str, float]:
    """Percentiles of the duration of ticks [µs], from the number of ticks by their duration [µs]."""
    values = np.array(sorted(ticks), dtype=float)
    times = ComputingTimes(values, np.array([ticks[value] for value in values.tolist()]), np.empty(0))
    p50, p99, p999 = times.percentiles([50.0, 99.0, 99.9])
    return {"p50": round(p50, 1), "p99": round(p99, 1), "p999": round(p999, 1)}
