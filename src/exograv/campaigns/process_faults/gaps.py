"""Gaps between two ticks of the guard after a strike."""

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from .evidence import FlightEvidence

STEP_US = 10
"""Resolution of the histogram of gaps [µs]."""

AFTER_S = 2.0
"""Time after the strike in which the guard's ticks are compared [s]."""


@dataclass(frozen=True)
class TickGaps:
    """Gaps between two ticks of the guard [ms], and their histogram."""

    p50_ms: float | None = None
    p99_ms: float | None = None
    worst_ms: float | None = None
    source: str = ""
    """"recording", or "drives" where the recording ends before the strike."""
    histogram: Mapping[str, int] = field(default_factory=dict)
    """Number of gaps by their length in steps of 10 µs."""


def gaps_of(evidence: FlightEvidence) -> TickGaps:
    """Return the gaps in `AFTER_S` after the strike, by the recording or by the commands at the drives."""
    begin = evidence.struck_t or 0.0
    until = begin + AFTER_S
    if evidence.released_t is not None:
        until = min(until, evidence.released_t)
    ticks = evidence.ticks
    recorded = np.empty(0) if ticks is None else ticks.t
    for source, t in (("recording", recorded), ("drives", evidence.drives.command_t)):
        inside = t[(t >= begin - 0.01) & (t <= until)]
        if len(inside) > 1 and inside[-1] > begin:
            return _figures(Counter(np.round(1e6 / STEP_US * np.diff(inside)).astype(int).tolist()), source)
    return TickGaps()


def pooled(each: Iterable[TickGaps]) -> TickGaps:
    """Return the gaps of several flights together."""
    counts = Counter[int]()
    for one in each:
        counts.update({int(length): number for length, number in one.histogram.items()})
    return _figures(counts, "all") if counts else TickGaps()


def _figures(counts: Counter[int], source: str) -> TickGaps:
    lengths = np.array(sorted(counts))
    share = np.cumsum([counts[length] for length in lengths.tolist()]) / counts.total()
    to_ms = 1e-3 * STEP_US

    def quantile(level: float) -> float:
        return round(to_ms * float(lengths[np.searchsorted(share, level)]), 2)

    histogram = {str(length): counts[length] for length in lengths.tolist()}
    return TickGaps(quantile(0.5), quantile(0.99), quantile(1.0), source, histogram)
