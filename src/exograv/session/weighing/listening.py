"""Listens to a motion and keeps its samples, all through the filter of identification."""

from exograv.identification.interface import Sample
from exograv.identification.sample_filter import SampleFilter
from exograv.session.pilot import Moment

SAMPLE_S = 0.08
"""Between two kept samples [s], as in identification."""


class Listener:
    """Give it to `Pilot.run`."""

    def __init__(self, joints: int, dt: float):
        self._filter = SampleFilter(joints, dt)
        self._every = round(SAMPLE_S / dt)
        self._ticks = 0
        self.samples: list[Sample] = []

    def __call__(self, moment: Moment) -> None:
        """One tick."""
        sample = self._filter.update(moment.state.q, moment.tau_measured)
        self._ticks += 1
        if self._filter.settled and self._ticks % self._every == 0:
            self.samples.append(Sample(sample.t, sample.q.copy(), sample.v.copy(), sample.a.copy(), sample.tau.copy()))
