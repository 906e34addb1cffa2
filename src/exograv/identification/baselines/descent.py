"""Half the squared torque error of one sample, downhill in numbers that keep every body possible."""

import numpy as np
from jaxtyping import Float

from exograv.identification.core.coordinates import Coordinate, Coordinates
from exograv.identification.core.interface import Estimate, Parameters, Sample
from exograv.identification.core.sample_pace import DESCENT_PERIOD_S, SamplePace
from exograv.identification.core.setting import Setting


class Descent:
    """Where a descent is, and which way is down; how far it goes is each method's own."""

    def __init__(self, setting: Setting):
        self._model, self._sd = setting.model, setting.residual_sd
        loose = setting.learned.copy()
        for body in setting.bodies:
            loose[body] = False
        self.coordinates = Coordinates(setting.bodies, setting.mean, np.eye(len(setting.mean))[:, loose])
        self.c: Coordinate = self.coordinates.start.copy()
        """Log-Cholesky numbers of the bodies, then what else is learned, less its start, in its own unit."""
        self.t = 0.0
        """Of the newest sample [s]."""
        self._pace = SamplePace(DESCENT_PERIOD_S)

    def slope(self, sample: Sample) -> Coordinate | None:
        """Gradient by `c` [(N·m)²] per unit; None for a sample that is passed over.

        A torque that the model itself cannot tell (a joint about to turn, an arm near a singular posture) counts less.
        """
        self.t = sample.t
        if not self._pace.takes(sample.t):
            return None
        error, derivative = self.error(sample)
        return derivative.T @ error

    def error(self, sample: Sample) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, "joint coordinate"]]:
        """Expected less measured torque [N·m], and its derivative by `c`; by what the model can tell of each joint."""
        x, x_by_c = self.coordinates.at(self.c)
        tau, derivative = self._model.linearise(sample, x)
        told = self._sd / np.hypot(self._sd, self._model.direction_uncertainty(sample.v))
        return told * (tau - sample.tau), told[:, None] * (derivative @ x_by_c)

    def parameters(self) -> Parameters:
        """Where the descent is."""
        return self.coordinates.at(self.c)[0]

    def estimate(self) -> Estimate:
        """The same as an estimate: descent states no uncertainty."""
        return Estimate(self.t, self.parameters(), None, 0.0, 1.0)
