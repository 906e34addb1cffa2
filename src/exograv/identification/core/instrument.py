"""Instrumental variables: regressor rows along the requested motion in place of the measured motion."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from .hidden_cuffs import Slipping
from .interface import Joints, Parameters, Sample, TorqueModel

FAR_RAD = 0.3
"""Largest distance from the requested posture [rad]. Beyond it the arm is blocked or led by a person, and the requested
motion says nothing about the measured one."""


class Instrumented:
    """Model that predicts torque along the measured motion and its derivative along the requested motion.

    The wearer's own torque moves the arm, so the measured motion correlates with the noise of the torque. A fit to rows
    of the measured motion then underestimates damping and stiffness, with more confidence the longer the motion lasts:
    at 2 N·m of own torque the dampings of the shoulder become negative. The requested motion is independent of the
    wearer and serves as the instrument (instrumental variables; for robots: Janot, Vandanjon and Gautier, IEEE Trans.
    Control Syst. Technol. 22, 2014). The gain grows with the square of the own torque. The loss, a tenth of the
    accuracy, is constant. A method that estimates the own torque therefore switches it on or off.
    """

    def __init__(self, measured: TorqueModel, asked: TorqueModel):
        """Take two models of the same arm: one follows the measured motion, the other the requested motion."""
        self._measured, self._asked = measured, asked
        self.n_joints, self.n_parameters = measured.n_joints, measured.n_parameters
        self._unsure = np.zeros(self.n_joints)
        self.is_on = True
        """True if rows are taken along the requested motion."""

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Return the expected torque (joint,) [N·m] on the measured motion, and its derivative.

        The derivative is taken on the requested motion unless the arm is more than `FAR_RAD` away from it.
        """
        tau, derivative = self._measured.linearise(sample, x)
        asked = sample.asked
        if not self.is_on or asked is None or np.abs(asked.q - sample.q).max() > FAR_RAD:
            self._unsure = np.zeros(self.n_joints)
            self._asked.restart()
            return tau, derivative
        requested = replace(sample, q=asked.q, v=asked.v, a=asked.a, asked=None)
        _, derivative = self._asked.linearise(requested, x)
        self._unsure = self._asked.direction_uncertainty(asked.v)
        return tau, derivative

    def slipped(self, x: Parameters) -> Float[np.ndarray, " cuff"]:
        """Return the distance by which each cuff has slipped along the limb, RMS over the motion [m]."""
        return self._measured.slipped(x) if isinstance(self._measured, Slipping) else np.zeros(0)

    def restart(self) -> None:
        """Start a new motion in both models."""
        self._measured.restart()
        self._asked.restart()

    def direction_uncertainty(self, v: Joints) -> Joints:
        """Return the standard deviation of the torque [N·m]: the larger of those of the two motions."""
        return np.maximum(self._measured.direction_uncertainty(v), self._unsure)
