"""Twin with a wearer who knows the mode of the machine, and supports the arm while the machine does not."""

import math

import numpy as np

from exograv.rig.twin import Twin
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.safety.modes import RAMP_IN_S, RAMP_OUT_S, Mode

from .cooperative_wearer import LET_GO_S, TwinProxy, grip_torque
from .virtual_laboratory import VirtualLaboratory


class AttentiveHold:
    """Muscles that hold the arm until the machine has taken it, and when it gives it back."""

    def __init__(self, twin: Twin, own: ArmInverseDynamics):
        """Hold the arm where it is.

        Args:
            twin: Twin with the wearer in it.
            own: The wearer's knowledge of the own arm.
        """
        self._twin, self._own = twin, own
        self._ramp, self._since_s, self._given_before = Mode.OFF, 0.0, 0.0
        self._given, self._grip = 0.0, 1.0
        self._hold()

    def hear(self, mode_name: str) -> None:
        """React to the start of a mode, given by its name in lower case."""
        mode = Mode[mode_name.upper()]
        if mode is Mode.SAFE and self._given:
            self._ramp, self._given, self._grip = mode, 1.0, 0.0  # The wearer is relaxed, and the arm is let down.
        if mode is Mode.EXO_ONLY and not self._grip:
            self._ramp, self._given = mode, 0.0  # The session starts again.
            self._hold()
        if mode is Mode.RAMP_OUT:
            self._hold()
        if mode in (Mode.RAMP_IN, Mode.RAMP_OUT):
            self._ramp, self._since_s, self._given_before = mode, self._twin.t, self._given

    def _hold(self) -> None:
        self._q = self._twin.truth.q_arm.copy()
        still = np.zeros_like(self._q)
        self._weight, self._grip = self._own.torque(self._q, still, still), 1.0

    def act(self) -> None:
        """Set the muscle torque for the next period."""
        passed = self._twin.t - self._since_s
        if self._ramp is Mode.RAMP_IN:
            self._given = 0.5 - 0.5 * math.cos(math.pi * min(passed / RAMP_IN_S, 1.0))
            self._grip = 1.0 - min(max((passed - RAMP_IN_S) / LET_GO_S, 0.0), 1.0)
        elif self._ramp is Mode.RAMP_OUT:
            self._given = self._given_before * (1.0 - min(passed / RAMP_OUT_S, 1.0))
        if self._given == 1.0 and not self._grip:  # The wearer is relaxed; reading the truth would only take time.
            self._twin.tau_voluntary[:] = 0.0
            return
        truth = self._twin.truth
        held = grip_torque(self._q, truth.q_arm, truth.v_arm)
        self._twin.tau_voluntary[:] = (1.0 - self._given) * self._weight + self._grip * held


class AttentiveTwin(TwinProxy):
    """Rig around the twin, with a wearer who hears the mode of the machine."""

    def __init__(self, twin: Twin, own: ArmInverseDynamics):
        """Hold the arm where it is.

        Args:
            twin: Twin with the wearer in it.
            own: The wearer's knowledge of the own arm.
        """
        super().__init__(twin)
        self._grip = AttentiveHold(twin, own)
        self.hear = self._grip.hear

    def _act(self) -> None:
        self._grip.act()


def attentive_twin(laboratory: VirtualLaboratory, seed: int, t: float) -> AttentiveTwin:
    """Make the twin at time `t` of its clock [s], in the donning posture."""
    return AttentiveTwin(laboratory.twin(seed, t), laboratory.own_arm())
