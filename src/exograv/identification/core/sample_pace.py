"""Which samples of the loop a method takes: after a filter with its corner at 7 Hz most only repeat each other."""

import numpy as np

from .interface import RequestedMotion, Sample

DESCENT_PERIOD_S = 0.02
"""Of methods that take single steps [s]: 50 Hz is seven times the corner."""

BATCH_PERIOD_S = 0.08
"""Of methods that keep their samples, as means [s]."""

EARLY = 0.05
"""Share of the period by which a sample may come early; a log's 100 Hz may be 101."""


class SamplePace:
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


class Averages:
    """Means of the samples over one period after another; the first sample is a mean of its own.

    One sample in 0.08 s would be enough for the motion, not for what rides on it: the ripple of a gear passes the
    7 Hz filter, and at the speed at which it turns once a period it looks like a torque of the posture, and
    stays in the estimate of whatever springs there are (docs/identification.md). In the mean it cancels.
    """

    def __init__(self, period_s: float):
        self._least_s = (1.0 - EARLY) * period_s
        self._values: list[np.ndarray] = []
        self._start_t = self._before_t = -np.inf

    def take(self, sample: Sample) -> Sample | None:
        """The mean of the period that `sample` is the last of, a copy; None while the period lasts.

        It is the last if one more, as far off as the one before, would lie beyond the period.
        """
        if not self._values:
            self._start_t = sample.t
        asked = sample.asked
        rows = [sample.q, sample.v, sample.a, sample.tau]
        self._values.append(np.array(rows if asked is None else [*rows, asked.q, asked.v, asked.a]))
        gap_s, self._before_t = sample.t - self._before_t, sample.t
        if sample.t + gap_s - self._start_t < self._least_s:
            return None
        q, v, a, tau, *of_asked = np.mean(self._values, axis=0)
        self._values.clear()
        return Sample(0.5 * (self._start_t + sample.t), q, v, a, tau, RequestedMotion(*of_asked) if of_asked else None)
