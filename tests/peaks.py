"""Peak of the memory that a piece of code takes."""

import gc
import tracemalloc
from collections.abc import Callable

PASSES = 6
"""Number of passes. With shape checks, up to one pass in four has a peak that is 0.8 MB lower; the largest of six
passes repeats within 0.05 MB."""


def largest_peak_bytes(run: Callable[[], object]) -> int:
    """Return the largest peak of `PASSES` passes, beyond the memory before each pass [bytes]."""
    return max(_peak_bytes(run) for _ in range(PASSES))


def _peak_bytes(run: Callable[[], object]) -> int:
    gc.collect()
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
