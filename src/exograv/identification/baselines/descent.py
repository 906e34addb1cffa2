"""Gradient of half the squared torque error of one sample, in coordinates that keep every body possible."""

import numpy as np
from jaxtyping import Float

from exograv.identification.core.coordinates import Coordinate, Coordinates
from exograv.identification.core.interface import Estimate, Parameters, Sample
from exograv.identification.core.sample_pace import DESCENT_PERIOD_S, SamplePace
from exograv.identification.core.setting import Setting


class Descent:
    """State and gradient of a descent; the step length is set by each method."""

    def __init__(self, setting: Setting):
        self._model, self._sd = setting.model, setting.residual_sd
        loose = setting.learned.copy()
        for body in setting.bodies:
            loose[body] = False
        self.coordinates = Coordinates(setting.bodies, setting.mean, np.eye(len(setting.mean))[:, loose])
        self.c: Coordinate = self.coordinates.start.copy()
        """Log-Cholesky coordinates of the bodies, then changes of the other learned parameters, in their own units."""
        self.t = 0.0
        """Time of the newest sample [s]."""
        self._pace = SamplePace(DESCENT_PERIOD_S)

    def slope(self, sample: Sample) -> Coordinate | None:
        """Gradient with respect to `c` [(N·m)² per unit]; None for a sample that is skipped.

        Torques that the model cannot predict weigh less: a joint about to reverse, an arm near a singular posture.
        """
        self.t = sample.t
        if not self._pace.takes(sample.t):
            return None
        error, derivative = self.error(sample)
        return derivative.T @ error

    def error(self, sample: Sample) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, "joint coordinate"]]:
        """Return expected minus measured torque [N·m] and its derivative with respect to `c`, weighted by joint."""
        x, x_by_c = self.coordinates.at(self.c)
        tau, derivative = self._model.linearise(sample, x)
        told = self._sd / np.hypot(self._sd, self._model.direction_uncertainty(sample.v))
        return told * (tau - sample.tau), told[:, None] * (derivative @ x_by_c)

    def parameters(self) -> Parameters:
        """Return the current parameters, in the model's order."""
        return self.coordinates.at(self.c)[0]

    def estimate(self) -> Estimate:
        """Return the current parameters as an estimate without uncertainty."""
        return Estimate(self.t, self.parameters(), None, 0.0, 1.0)
