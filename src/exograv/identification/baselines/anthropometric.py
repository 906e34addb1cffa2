"""The table and nothing else: the baseline that measures nothing."""

from exograv.identification.core.interface import Covariance, Estimate, Parameters, Sample


class Anthropometric:
    """`Method` that never learns; its interval is the prior's."""

    name = "anthropometric"

    def __init__(self, mean: Parameters, covariance: Covariance):
        self._mean, self._covariance = mean, covariance
        self._t = 0.0

    def update(self, sample: Sample) -> None:
        """Only the clock runs."""
        self._t = sample.t

    def estimate(self) -> Estimate:
        """The prior."""
        return Estimate(self._t, self._mean, self._covariance, 0.0, 1.0)
