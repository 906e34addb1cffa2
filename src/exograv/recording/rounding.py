"""Numbers as they are written into results: no digit without meaning."""

from collections.abc import Sequence

import numpy as np

DECIMALS = 4


def rounded(values: np.ndarray) -> list[float]:
    """For people and for files: no digit that means nothing."""
    return [round(float(value), DECIMALS) for value in values]


def percentiles(tick_us: Sequence[float]) -> dict[str, float]:
    """Of the time that ticks took [µs]."""
    p50, p99, p999 = np.percentile(tick_us, [50, 99, 99.9])
    return {"p50": round(float(p50), 1), "p99": round(float(p99), 1), "p999": round(float(p999), 1)}
