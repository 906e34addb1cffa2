"""A virtual person who holds the own arm until the machine has taken it, and then lets go."""

import math
from collections.abc import Callable
from functools import partial
from types import TracebackType

import numpy as np

from exograv.rig.twin import Twin
from exograv.rig.twin.behaviour.internal_model import OwnArm
from exograv.safety.modes import RAMP_IN_S, REST_BEFORE_RAMP_S
from exograv.signals import Command, JointState

from .virtual_laboratory import VirtualLaboratory

STIFFNESS, DAMPING = 30.0, 3.0
"""Of an arm that is held still [N·m/rad, N·m·s/rad]: a tenth of what an arm can (assumed)."""

LET_GO_S = 1.0


class Grip:
    """What the person's muscles do meanwhile: hold the arm where it is, and give its weight over along a curve."""

    def __init__(self, twin: Twin, own: OwnArm):
        """The arm is held where it is.

        Args:
            twin: With the wearer in it.
            own: What the wearer knows of the own arm.
        """
        self._twin, self._q = twin, twin.truth.q_arm
        still = np.zeros_like(self._q)
        self._weight = own.torque(self._q, still, still)
        self._from, self._for, self._holds = math.inf, 1.0, True

    def give_over(self, begins_s: float, takes_s: float) -> None:
        """The machine takes the arm from this time of the twin's clock on [s], in so long [s]."""
        self._from, self._for = begins_s, takes_s

    def act(self) -> None:
        """For the next period of the twin."""
        if not self._holds:
            return
        passed = self._twin.t - self._from
        given = 0.5 - 0.5 * math.cos(math.pi * min(max(passed / self._for, 0.0), 1.0))
        grip = 1.0 - min(max((passed - self._for) / LET_GO_S, 0.0), 1.0)
        truth = self._twin.truth
        held = STIFFNESS * (self._q - truth.q_arm) - DAMPING * truth.v_arm
        self._twin.tau_voluntary[:] = (1.0 - given) * self._weight + grip * held
        self._holds = grip > 0.0


class OverTwin:
    """A `Rig`: the twin, whose wearer acts before each of its steps."""

    def __init__(self, twin: Twin):
        """With a wearer in it."""
        self._twin = twin

    @property
    def joints(self) -> tuple[str, ...]:
        """Of the twin."""
        return self._twin.joints

    @property
    def period_s(self) -> float:
        """Of the twin [s]."""
        return self._twin.period_s

    @property
    def t(self) -> float:
        """The twin's clock [s]."""
        return self._twin.t

    @property
    def is_virtual(self) -> bool:
        """As the twin."""
        return True

    def read(self) -> JointState:
        """What the twin measures."""
        return self._twin.read()

    def write(self, command: Command) -> None:
        """Let the wearer act, and the twin go on by one period."""
        self._act()
        self._twin.write(command)

    def _act(self) -> None:
        """Muscles, for the next period."""

    def __enter__(self) -> "OverTwin":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing to let go of."""


class CooperativeWearer(OverTwin):
    """A `Rig`: the twin, with a wearer who does for the arm what the machine does not do yet.

    The person is told when the machine begins and how long it takes, and gives the weight over along the same curve.
    """

    def __init__(self, twin: Twin, own: OwnArm, takes_from_s: float, takes_for_s: float):
        """The arm is held where it is.

        Args:
            twin: With the wearer in it.
            own: What the wearer knows of the own arm.
            takes_from_s: When the machine begins to take the arm, from now [s].
            takes_for_s: How long it takes [s].
        """
        super().__init__(twin)
        self._grip = Grip(twin, own)
        self._grip.give_over(twin.t + takes_from_s, takes_for_s)

    def _act(self) -> None:
        self._grip.act()


def held_machine(laboratory: VirtualLaboratory, seed: int, t: float) -> Callable[[], CooperativeWearer]:
    """A function that makes the twin in the process that owns it, its wearer holding the own arm."""
    return partial(held_twin, laboratory, seed, t)


def held_twin(laboratory: VirtualLaboratory, seed: int, t: float) -> CooperativeWearer:
    """The twin, its wearer holding the own arm in the donning posture, at the time `t` of its clock [s]."""
    return CooperativeWearer(laboratory.twin(seed, t), laboratory.own_arm(), REST_BEFORE_RAMP_S, RAMP_IN_S)
