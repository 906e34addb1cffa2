"""Conversion of times to ticks: safety times are stated in milliseconds, and a bus may have a period of 2 or 4 ms."""

import math


def ticks_of(ms: int, period_s: float) -> int:
    """Smallest number of ticks that lasts at least `ms` milliseconds."""
    return math.ceil(round(ms / (1e3 * period_s), 6))
