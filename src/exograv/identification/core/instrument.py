"""Rows of a motion that the person has not moved: what was asked for, in place of what was measured."""

import numpy as np
from jaxtyping import Float

from .interface import Joints, Parameters, Sample, TorqueModel

FAR_RAD = 0.3
"""So far from the asked posture the arm is blocked or led by somebody: what was asked tells nothing then."""


class Instrumented:
    """`TorqueModel` that expects the torque of the measured motion, and derives it along the motion asked for.

    A wearer's own torque moves the arm, so that the measured motion goes along with the very noise of the torque. What
    is fitted to rows of that motion then takes too little damping and stiffness, the surer the longer it lasts: at two
    newton metres of own torque the dampings of the shoulder come out negative. No wearer has moved the motion that was
    asked for: an instrument, as in the econometricians' method of instrumental variables, whose use for robots
    Janot, Vandanjon and Gautier describe (IEEE Trans. Control Syst. Technol. 22, 2014). What is gained goes with the
    square of the own torque, and what is lost, a tenth of the accuracy, does not: a method that knows how restless the
    wearer is says whether to.
    """

    def __init__(self, measured: TorqueModel, asked: TorqueModel):
        """Take two models of the same, each of which follows one of the motions."""
        self._measured, self._asked = measured, asked
        self.n_joints, self.n_parameters = measured.n_joints, measured.n_parameters
        self._unsure = np.zeros(self.n_joints)
        self.is_on = True
        """Whether rows are taken along the motion asked for."""

    def linearise(self, sample: Sample, x: Parameters) -> tuple[Joints, Float[np.ndarray, "joint parameter"]]:
        """Expected torque (joint,) [N·m] where the arm is; its derivative where it should be, if it is not far off."""
        tau, derivative = self._measured.linearise(sample, x)
        asked = sample.asked
        if not self.is_on or asked is None or np.abs(asked.q - sample.q).max() > FAR_RAD:
            self._unsure = np.zeros(self.n_joints)
            self._asked.restart()
            return tau, derivative
        _, derivative = self._asked.linearise(Sample(sample.t, asked.q, asked.v, asked.a, sample.tau), x)
        self._unsure = self._asked.direction_uncertainty(asked.v)
        return tau, derivative

    def restart(self) -> None:
        """The next sample does not follow the one before."""
        self._measured.restart()
        self._asked.restart()

    def direction_uncertainty(self, v: Joints) -> Joints:
        """As of the less certain of the two motions."""
        return np.maximum(self._measured.direction_uncertainty(v), self._unsure)
