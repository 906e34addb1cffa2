"""Sample collection during a motion, through the filter of identification."""

from exograv.identification.core.interface import Sample
from exograv.identification.core.sample_filter import SampleFilter
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages
from exograv.loop.tick_sample import Joints, TickSample

SAMPLE_S = BATCH_PERIOD_S
"""Averaging time of a stored sample [s], as in identification."""


class SampleCollector:
    """Observer of an identification that stores averaged samples."""

    def __init__(self):
        self._averages = Averages(SAMPLE_S)
        self.samples: list[Sample] = []

    def __call__(self, sample: Sample) -> None:
        """Add a sample to the running average, and store each complete average."""
        mean = self._averages.take(sample)
        if mean is not None:
            self.samples.append(mean)


class MotionListener:
    """Listener that stores averaged samples of a motion without identification."""

    def __init__(self, joints: int, dt: float):
        self._filter, self._kept = SampleFilter(joints, dt), SampleCollector()

    def __call__(self, moment: TickSample) -> None:
        """Take one tick of `Pilot.run`."""
        self.take(moment.state.q, moment.tau_measured)

    def take(self, q: Joints, tau: Joints) -> None:
        """Filter position [rad] and torque [N·m] of one tick. Samples are stored after the filter has settled."""
        sample = self._filter.update(q, tau)
        if self._filter.settled:
            self._kept(sample)

    @property
    def samples(self) -> list[Sample]:
        """Averaged samples that were stored so far."""
        return self._kept.samples
