"""A model seen through its prior: numbers of which each is, before the motion, as likely to be one off as any other."""

import numpy as np
from jaxtyping import Float

from .interface import Covariance, Joints, Parameters, Sample
from .setting import Setting
from .square_root import square_root

PLAUSIBLE_SD = 2.5
"""Standard deviations from the prior up to which the model is linearised; beyond it goes on straight. With parameters
far from any person's the arm would fall out of its cuffs."""

Unknowns = Float[np.ndarray, " unknown"]


class WhitenedModel:
    """Parameters x = mean + L ξ with ξ ~ N(0, 1): the scale in which a step, a norm or a projection means something.

    Kilograms, metres and newton-metres per radian have no common length; a method that steps along a gradient or
    projects onto an equation needs one. The prior's is the natural one, and the same for all.
    """

    def __init__(self, setting: Setting):
        self._model, self._sd = setting.model, setting.residual_sd
        self.mean, self.L = setting.mean, square_root(setting.covariance)
        self.count = self.L.shape[1]
        """Number of unknowns."""

    def rows(self, sample: Sample, xi: Unknowns) -> tuple[Joints, Float[np.ndarray, "joint unknown"]]:
        """Torque that ξ does not explain and its negative derivative by ξ, both in units of the sample's noise [-]."""
        near = np.clip(xi, -PLAUSIBLE_SD, PLAUSIBLE_SD)
        tau, derivative = self._model.linearise(sample, self.mean + self.L @ near)
        sd = np.hypot(self._sd, self._model.direction_uncertainty(sample.v))
        H = derivative @ self.L / sd[:, None]
        return (sample.tau - tau) / sd - H @ (xi - near), H

    def x(self, xi: Unknowns) -> Parameters:
        """Parameters in the model's order."""
        return self.mean + self.L @ xi

    def covariance(self, of_xi: Float[np.ndarray, "unknown unknown"]) -> Covariance:
        """Of the parameters, from that of ξ."""
        return self.L @ of_xi @ self.L.T


def square_root_but(bodies: tuple[slice, ...], covariance: Covariance) -> Float[np.ndarray, "parameter unknown"]:
    """Square root of the covariance of all but the bodies, whose rows are zero."""
    others = covariance.copy()
    for body in bodies:
        others[body, :] = others[:, body] = 0.0
    return square_root(others)
