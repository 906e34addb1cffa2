"""Which samples of the loop a method takes: after a filter with its corner at 7 Hz most only repeat each other."""

DESCENT_PERIOD_S = 0.02
"""Of methods that take single steps [s]: 50 Hz is seven times the corner."""

BATCH_PERIOD_S = 0.08
"""Of methods that keep their samples [s]: as `recursive`."""

EARLY = 0.05
"""Share of the period by which a sample may come early; a log's 100 Hz may be 101."""


class Pace:
    """Takes the first sample, and then those at least a period after the last one taken."""

    def __init__(self, period_s: float):
        self._gap_s = (1.0 - EARLY) * period_s
        self._taken_t: float | None = None

    def takes(self, t: float) -> bool:
        """Whether the sample at `t` [s] is to be taken; asked once per sample."""
        if self._taken_t is not None and t - self._taken_t < self._gap_s:
            return False
        self._taken_t = t
        return True
