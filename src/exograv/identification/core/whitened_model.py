"""Torque model in whitened unknowns: before any motion each unknown is standard normal."""

import numpy as np
from jaxtyping import Float

from .interface import Covariance, Joints, Parameters, Sample
from .setting import Setting
from .square_root import square_root

PLAUSIBLE_SD = 2.5
"""Largest distance from the prior at which the model is linearised [standard deviations]; it is extrapolated linearly
beyond. With implausible parameters the closure of the cuffs has no solution."""

Unknowns = Float[np.ndarray, " unknown"]


class WhitenedModel:
    """Model in unknowns ξ ~ N(0, 1), with parameters x = mean + L ξ.

    A method that steps along a gradient or projects onto an equation needs a norm, but kilograms, metres and N·m/rad
    have no common unit. The prior's standard deviation is the natural unit, and it is the same for all methods.
    """

    def __init__(self, setting: Setting):
        self._model, self._sd = setting.model, setting.residual_sd
        self.mean, self.L = setting.mean, square_root(setting.covariance)
        self.count = self.L.shape[1]
        """Number of unknowns."""

    def rows(self, sample: Sample, xi: Unknowns) -> tuple[Joints, Float[np.ndarray, "joint unknown"]]:
        """Residual torque at ξ, and its negative derivative with respect to ξ, in units of the sample's noise [-]."""
        near = np.clip(xi, -PLAUSIBLE_SD, PLAUSIBLE_SD)
        tau, derivative = self._model.linearise(sample, self.mean + self.L @ near)
        sd = np.hypot(self._sd, self._model.direction_uncertainty(sample.v))
        H = derivative @ self.L / sd[:, None]
        return (sample.tau - tau) / sd - H @ (xi - near), H

    def x(self, xi: Unknowns) -> Parameters:
        """Parameters in the model's order."""
        return self.mean + self.L @ xi

    def covariance(self, of_xi: Float[np.ndarray, "unknown unknown"]) -> Covariance:
        """Covariance of the parameters, from the covariance of ξ."""
        return self.L @ of_xi @ self.L.T


def square_root_but(bodies: tuple[slice, ...], covariance: Covariance) -> Float[np.ndarray, "parameter unknown"]:
    """Square root of the covariance without the bodies; the rows of the bodies are zero."""
    others = covariance.copy()
    for body in bodies:
        others[body, :] = others[:, body] = 0.0
    return square_root(others)
