"""Virtual wearer who holds up the own arm until the machine carries it, and then relaxes."""

import functools
import math
from collections.abc import Callable
from types import TracebackType

import numpy as np

from exograv.rig.twin import Twin
from exograv.rig.twin.behaviour.acting_wearer import PerFreedom, usual_physiology
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics
from exograv.safety.modes import RAMP_IN_S, REST_BEFORE_RAMP_S
from exograv.signals import Command, JointState

from .virtual_laboratory import VirtualLaboratory

STIFFNESS_MAX, DAMPING_MAX = 30.0, 3.0
"""Stiffness and damping of a shoulder or elbow that is held still [N·m/rad, N·m·s/rad]: a tenth of the maximum
(assumed)."""

STIFFNESS_SHARE, DAMPING_SHARE = 2.5, 3.0
"""Stiffness and damping of a joint that is held still, relative to usual ones, up to the maximum [-]. They limit the
small joints only: 3 N·m·s/rad at a forearm of 0.001 kg·m² would be unstable at the twin's period."""

LET_GO_S = 1.0


def grip_torque(q_held: PerFreedom, q: PerFreedom, v: PerFreedom) -> PerFreedom:
    """Muscle torque (freedom,) that pulls an arm back to the posture in which it is held [N·m].

    Args:
        q_held: Posture in which the arm is held [rad].
        q: Joint position [rad].
        v: Joint velocity [rad/s].
    """
    stiffness, damping = grip_impedance(len(q))
    return stiffness * (q_held - q) - damping * v


@functools.cache
def grip_impedance(freedoms: int) -> tuple[PerFreedom, PerFreedom]:
    """Return stiffness [N·m/rad] and damping [N·m·s/rad] of an arm that is held still, or of two arms."""
    usual = usual_physiology(freedoms)
    return (
        np.minimum(STIFFNESS_MAX, STIFFNESS_SHARE * usual.stiffness),
        np.minimum(DAMPING_MAX, DAMPING_SHARE * usual.damping),
    )


class ArmHold:
    """Muscles that hold the arm in its posture, and hand its weight over along a curve."""

    def __init__(self, twin: Twin, own: ArmInverseDynamics):
        """Hold the arm in its present posture.

        Args:
            twin: Twin with the wearer in it.
            own: The wearer's knowledge of the own arm.
        """
        self._twin, self._q = twin, twin.truth.q_arm
        still = np.zeros_like(self._q)
        self._weight = own.torque(self._q, still, still)
        self._from, self._for, self._holds = math.inf, 1.0, True

    def give_over(self, begins_s: float, takes_s: float) -> None:
        """Hand the weight over to the machine from time `begins_s` of the twin's clock on, within `takes_s` [s]."""
        self._from, self._for = begins_s, takes_s

    def act(self) -> None:
        """Set the muscle torque for the next period of the twin."""
        if not self._holds:
            return
        passed = self._twin.t - self._from
        given = 0.5 - 0.5 * math.cos(math.pi * min(max(passed / self._for, 0.0), 1.0))
        grip = 1.0 - min(max((passed - self._for) / LET_GO_S, 0.0), 1.0)
        truth = self._twin.truth
        held = grip_torque(self._q, truth.q_arm, truth.v_arm)
        self._twin.tau_voluntary[:] = (1.0 - given) * self._weight + grip * held
        self._holds = grip > 0.0


class TwinProxy:
    """`Rig` around the twin: the wearer acts before each of its steps."""

    def __init__(self, twin: Twin):
        """Wrap a twin that has a wearer in it."""
        self._twin = twin

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints of the twin."""
        return self._twin.joints

    @property
    def period_s(self) -> float:
        """Period of the twin [s]."""
        return self._twin.period_s

    @property
    def t(self) -> float:
        """The twin's clock [s]."""
        return self._twin.t

    @property
    def is_virtual(self) -> bool:
        """True: the rig exists in simulation only."""
        return True

    def read(self) -> JointState:
        """Read the measurement of the twin."""
        return self._twin.read()

    def write(self, command: Command) -> None:
        """Let the wearer act, then advance the twin by one period."""
        self._act()
        self._twin.write(command)

    def _act(self) -> None:
        """Set the muscle torque for the next period."""

    def __enter__(self) -> "TwinProxy":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Do nothing: there is no resource to release."""


class CooperativeWearer(TwinProxy):
    """`Rig` around the twin, with a wearer who holds up the arm until the machine carries it.

    The wearer knows when the machine begins and how long it takes, and hands the weight over along the same curve.
    """

    def __init__(self, twin: Twin, own: ArmInverseDynamics, takes_from_s: float, takes_for_s: float):
        """Hold the arm in its present posture.

        Args:
            twin: Twin with the wearer in it.
            own: The wearer's knowledge of the own arm.
            takes_from_s: Time from now until the machine begins to take the arm [s].
            takes_for_s: Duration of the handover [s].
        """
        super().__init__(twin)
        self._grip = ArmHold(twin, own)
        self._grip.give_over(twin.t + takes_from_s, takes_for_s)

    def _act(self) -> None:
        self._grip.act()


def cooperative_machine(laboratory: VirtualLaboratory, seed: int, t: float) -> Callable[[], CooperativeWearer]:
    """Return a function that makes the cooperative twin in the process that owns it."""
    return functools.partial(cooperative_twin, laboratory, seed, t)


def cooperative_twin(laboratory: VirtualLaboratory, seed: int, t: float) -> CooperativeWearer:
    """Make the twin at time `t` of its clock [s], its wearer holding the own arm in the donning posture."""
    return CooperativeWearer(laboratory.twin(seed, t), laboratory.own_arm(), REST_BEFORE_RAMP_S, RAMP_IN_S)
