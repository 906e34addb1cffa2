"""Listens to a motion and keeps its samples, all through the filter of identification."""

from exograv.identification.core.interface import Sample
from exograv.identification.core.sample_filter import SampleFilter
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.loop.pilot import TickSample

SAMPLE_S = BATCH_PERIOD_S
"""That a kept sample is the mean of [s], as in identification."""


class Kept:
    """Follows an identification."""

    def __init__(self):
        self._averages = Averages(SAMPLE_S)
        self.samples: list[Sample] = []

    def __call__(self, sample: Sample) -> None:
        """One sample."""
        mean = self._averages.take(sample)
        if mean is not None:
            self.samples.append(mean)


class Listener:
    """The same of a motion without a method: give it to `Pilot.run`."""

    def __init__(self, joints: int, dt: float):
        self._filter, self._kept = SampleFilter(joints, dt), Kept()

    def __call__(self, moment: TickSample) -> None:
        """One tick."""
        sample = self._filter.update(moment.state.q, moment.tau_measured)
        if self._filter.settled:
            self._kept(sample)

    @property
    def samples(self) -> list[Sample]:
        """Those so far."""
        return self._kept.samples
