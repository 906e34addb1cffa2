"""Anthropometric baseline: the table's arm, without any measurement."""

from exograv.identification.core.interface import Covariance, Estimate, Parameters, Sample


class Anthropometric:
    """Method that does not learn; its interval is the prior's."""

    name = "anthropometric"

    def __init__(self, mean: Parameters, covariance: Covariance):
        self._mean, self._covariance = mean, covariance
        self._t = 0.0

    def update(self, sample: Sample) -> None:
        """Advance the clock; the sample is not used."""
        self._t = sample.t

    def estimate(self) -> Estimate:
        """Return the prior: the arm of the table, with the table's uncertainty."""
        return Estimate(self._t, self._mean, self._covariance, 0.0, 1.0)
