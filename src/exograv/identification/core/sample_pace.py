"""Choice of samples at a lower rate than the loop's: after a 7 Hz filter most samples repeat each other."""

import numpy as np

from .interface import RequestedMotion, Sample

DESCENT_PERIOD_S = 0.02
"""Period of methods that make a step per sample [s]: 50 Hz is seven times the corner frequency."""

BATCH_PERIOD_S = 0.08
"""Period of methods that store their samples, as means [s]."""

EARLY = 0.05
"""Share of the period by which a sample may be early [-], because a log of nominally 100 Hz may have 101 Hz."""


class SamplePace:
    """Selection of the first sample, then of each sample at least one period after the last selected one."""

    def __init__(self, period_s: float):
        self._gap_s = (1.0 - EARLY) * period_s
        self._taken_t: float | None = None

    def takes(self, t: float) -> bool:
        """Return True if the sample at `t` [s] is selected. Call once per sample."""
        if self._taken_t is not None and t - self._taken_t < self._gap_s:
            return False
        self._taken_t = t
        return True


class Averages:
    """Means of the samples over consecutive periods; the first sample is a mean of its own.

    One sample in 0.08 s would be enough for the motion, but it would alias gear ripple, which passes the 7 Hz filter.
    At the speed at which the ripple has one cycle per period it looks like a torque of the posture, and it biases the
    estimated springs (docs/explanation/identification.md). The mean cancels it.
    """

    def __init__(self, period_s: float):
        self._least_s = (1.0 - EARLY) * period_s
        self._rows: list[bytes] = []
        self._is_plain = False
        self._start_t = self._before_t = -np.inf

    def take(self, sample: Sample) -> Sample | None:
        """Return a copy of the period's mean if `sample` is its last one, otherwise None.

        A sample is the last one if the next, at the same distance as the previous one, would lie outside the period.
        """
        asked, muscles = sample.asked, sample.muscles
        values = (sample.q, sample.v, sample.a, sample.tau)
        if asked is not None:
            values = (*values, asked.q, asked.v, asked.a)
        if muscles is not None:
            values = (*values, muscles)
        if not self._rows:
            self._start_t = sample.t
            self._is_plain = all(one.dtype == np.float64 and one.flags.c_contiguous for one in values)
        # Bytes of plain arrays are joined in a third of the time that NumPy takes for some numbers.
        self._rows.append(_bytes(values) if self._is_plain else np.concatenate(values, dtype=float).tobytes())
        gap_s, self._before_t = sample.t - self._before_t, sample.t
        if sample.t + gap_s - self._start_t < self._least_s:
            return None
        rows = np.frombuffer(b"".join(self._rows)).reshape(len(self._rows), -1)
        mean = rows.mean(axis=0)
        of_motion = len(mean) - (0 if muscles is None else len(muscles))
        q, v, a, tau, *of_asked = mean[:of_motion].reshape(-1, len(sample.q))
        self._rows.clear()
        motion = RequestedMotion(*of_asked) if of_asked else None
        of_muscles = None if muscles is None else mean[of_motion:]
        return Sample(0.5 * (self._start_t + sample.t), q, v, a, tau, motion, of_muscles)


def _bytes(arrays: tuple[np.ndarray, ...]) -> bytes:
    return b"".join(arrays)  # pyright: ignore[reportArgumentType] - the stub lacks the buffer of an array
