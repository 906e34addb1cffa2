"""Percentiles of a row from times of calls."""

import numpy as np
from jaxtyping import Float

PERCENTILES = {"p50": 50.0, "p99": 99.0, "p999": 99.9, "max": 100.0}
SHORTEST_NS = 1.0
"""Shortest time of a call: without the clock's own time an empty call may come out negative."""


def percentiles_us(times_ns: Float[np.ndarray, " call"]) -> dict[str, float]:
    """Return percentiles of the time of a call [µs]."""
    times = np.maximum(times_ns, SHORTEST_NS)
    return {key: float(np.percentile(times, q)) / 1e3 for key, q in PERCENTILES.items()}


def percentiles_per_s(times_ns: Float[np.ndarray, " call"], size: int) -> dict[str, float]:
    """Return evaluations a second of a batch at percentiles of its time: `max` is the rate of the slowest call."""
    return {key: size / (1e-6 * time_us) for key, time_us in percentiles_us(times_ns).items()}
