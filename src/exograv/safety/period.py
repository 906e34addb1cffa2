"""How many ticks a time is: what protects a person is stated in milliseconds, and a bus may carry a loop of 2 or 4."""

import math


def ticks_of(ms: int, period_s: float) -> int:
    """Ticks of this period that are so many milliseconds, or just more."""
    return math.ceil(round(ms / (1e3 * period_s), 6))
