"""Quality of a recorded stream while it comes: its rate, its gaps and its clock, from stamps and clock corrections."""

from collections import deque
from dataclasses import dataclass
from enum import Enum

import numpy as np
from jaxtyping import Float

from exograv.recording.stream_block import GAP_PERIODS

RATE_OVER_S = 5.0
"""Time over which the rate is counted [s], on the clock of the stream."""


class StreamCondition(Enum):
    """Condition of a stream of another device."""

    AWAITED = "awaited"
    """Found; nothing is recorded yet."""
    RECORDED = "recorded"
    SILENT = "silent"
    """Condition of a stream whose source is there, and sends no samples."""
    LOST = "lost"
    """Condition of a stream whose source is gone."""


@dataclass(frozen=True)
class StreamQuality:
    """Quality of one connection of a stream, from its first sample until now."""

    topic: str
    """Channel of its samples in the recording."""
    rate_Hz: float | None
    """Samples per second of the stream's own clock in the last `RATE_OVER_S`; None before there are enough."""
    gaps: int
    """Number of intervals longer than `GAP_PERIODS` periods of the nominal rate; 0 without a nominal rate."""
    offset_s: float | None
    """Last clock correction [s]: added to a stamp it gives CLOCK_MONOTONIC; None before the first one."""
    uncertainty_s: float | None
    """Uncertainty of the correction [s]: the round trip of the best request, by LSL."""


class StampWatch:
    """Counts samples and gaps of one connection from the stamps of its samples."""

    def __init__(self, nominal_Hz: float):
        """Watch a stream with this nominal rate [1/s]; 0 for a stream without one."""
        self._longest_s = GAP_PERIODS / nominal_Hz if nominal_Hz > 0.0 else np.inf
        self._newest = np.nan
        self._passed = deque[tuple[float, int]]()
        self.samples = self.gaps = 0

    def see(self, stamps: Float[np.ndarray, " sample"]) -> None:
        """Count new samples by their stamps [s]."""
        if not len(stamps):
            return
        intervals = np.diff(stamps, prepend=self._newest)
        self.gaps += int(np.count_nonzero(intervals > self._longest_s))
        self.samples += len(stamps)
        self._newest = float(stamps[-1])
        self._passed.append((self._newest, self.samples))
        while len(self._passed) > 2 and self._newest - self._passed[1][0] > RATE_OVER_S:
            self._passed.popleft()

    @property
    def rate_Hz(self) -> float | None:
        """Number of samples per second of the stream's clock; None before a second of samples."""
        if len(self._passed) < 2 or (span := self._passed[-1][0] - self._passed[0][0]) < 1.0:
            return None
        return (self._passed[-1][1] - self._passed[0][1]) / span
