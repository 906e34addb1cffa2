"""Where a scenario is flown: a machine to read and command, a world that may go wrong, and an examiner who looks on."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.errors import RigError
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig.twin import Twin
from exograv.safety.envelope import Limits
from exograv.safety.person import PersonLimits
from exograv.signals import Command, JointState

Joints = Float[np.ndarray, " joint"]

SWAY_HZ, SWAY_STIFFNESS, SWAY_DAMPING = 0.8, 12.0, 1.5
"""Of a person who moves the arm [Hz, N·m/rad, N·m·s/rad]."""


@dataclass(frozen=True)
class FaultSubject:
    """A person in a machine, known to the software as after an identification."""

    laboratory: VirtualLaboratory
    prepared: ControllerKnowledge
    controller: ArmController
    limits: Limits
    person: PersonLimits


class FlightStart(NamedTuple):
    """How a flight begins."""

    seed: int
    """Of the twin's run."""

    posture: Joints
    """Where the arm floats at first [rad]."""

    moves: Joints
    """The person's slow push at the joints, as amplitude of a sine [N·m]; zero for a relaxed person."""


class Sight(NamedTuple):
    """Of one moment, by the twin's truth: the examiner's business, nobody flies by it."""

    q: Joints
    """[rad]"""

    v: Joints
    """[rad/s]"""

    hand_m_s: float
    are_braking: bool
    """All drives by themselves, since the moment before."""


@runtime_checkable
class World(Protocol):
    """What a fault may do to machine and person."""

    @property
    def q(self) -> Joints:
        """What the machine said last [rad]."""
        ...

    def push(self, joint: int, torque: float) -> None:
        """The person pushes so much more from now on [N·m]."""
        ...

    def hang(self, mount: str, mass_kg: float) -> None:
        """Somebody puts a weight there."""
        ...

    def turn_motor(self, joint: int, factor: float) -> None:
        """A motor has so many times its torque constant from now on."""
        ...

    def at_bench(self, word: str, joint: int | None = None, number: float | None = None) -> None:
        """Done at the bench of simulated drives (`exograv drive-sim`, help)."""
        ...

    def is_silent(self) -> None:
        """Nothing will answer any more, so that nobody waits for it in lock-step."""
        ...


@runtime_checkable
class Stand(World, Protocol):
    """A machine in lock-step, with the person in it."""

    @property
    def t(self) -> float:
        """Its clock [s]."""
        ...

    @property
    def period_s(self) -> float:
        """Between two measurements [s]."""
        ...

    def read(self) -> JointState:
        """Begin a tick."""
        ...

    def write(self, command: Command) -> None:
        """End it."""
        ...

    def go_on(self, last: Command) -> None:
        """End it where nobody is left to write; the drives have heard this last."""
        ...

    def sights(self) -> list[Sight]:
        """One for every tick, when the flight is over."""
        ...


class Swaying:
    """A twin whose wearer sways the arm about where it was: a slow push, held back; beside whatever else pushes."""

    def __init__(self, twin: Twin, moves: Joints):
        """By pushes of this amplitude [N·m]."""
        self.twin, self._moves, self._own = twin, moves, np.zeros_like(twin.tau_voluntary)
        self._held_at, self._steps = twin.truth.q_arm.copy(), 0

    def look(self) -> Sight:
        """Now."""
        seen = self.twin.truth
        return Sight(seen.q, seen.v, self.twin.hand_speed(), bool((self.twin.drive_damping() > 0.0).all()))

    def sway(self) -> None:
        """For the next step of the twin."""
        if self._moves.any():
            seen, phase = self.twin.truth, 2.0 * np.pi * SWAY_HZ * self.twin.period_s * self._steps
            own = (
                self._moves * np.sin(phase) - SWAY_STIFFNESS * (seen.q_arm - self._held_at) - SWAY_DAMPING * seen.v_arm
            )
            self.twin.tau_voluntary += own - self._own
            self._own = own
        self._steps += 1


def twin_of(laboratory: VirtualLaboratory, start: FlightStart, t0: float) -> Twin:
    """The person in the machine, the arm held in a posture, as long after it was switched on as `t0` [s]."""
    return laboratory.twin(start.seed, t0, start.posture)


class TwinStand:
    """The twin itself, in this process."""

    def __init__(self, subject: FaultSubject, start: FlightStart):
        self._twin = twin_of(subject.laboratory, start, subject.prepared.t)
        self._person, self._sights = Swaying(self._twin, start.moves), list[Sight]()

    @property
    def t(self) -> float:
        """The twin's clock [s]."""
        return self._twin.t

    @property
    def period_s(self) -> float:
        """Between two measurements [s]."""
        return self._twin.period_s

    def read(self) -> JointState:
        """Begin a tick."""
        self._sights.append(self._person.look())
        self._person.sway()
        return self._twin.read()

    def write(self, command: Command) -> None:
        """End it."""
        self._twin.write(command)

    def go_on(self, last: Command) -> None:
        """The twin advances with a command only; this one is void before long."""
        self._twin.write(last)

    def sights(self) -> list[Sight]:
        """One for every tick, and of how the last one ended."""
        return [*self._sights, self._person.look()]

    @property
    def q(self) -> Joints:
        """As measured [rad]."""
        return self._twin.read().q

    def push(self, joint: int, torque: float) -> None:
        """By the wearer's muscles."""
        self._twin.tau_voluntary[joint] += torque

    def hang(self, mount: str, mass_kg: float) -> None:
        """At once."""
        self._twin.hang(mount, mass_kg)

    def turn_motor(self, joint: int, factor: float) -> None:
        """What flows to it and is said of it, whoever asks for this turns too."""
        self._twin.turn_motor(joint, factor)

    def at_bench(self, word: str, joint: int | None = None, number: float | None = None) -> None:
        """There is none.

        Raises:
            RigError: Always.
        """
        raise RigError(f"'{word}' is done at simulated drives; this twin has none. Fly it through a driver.")

    def is_silent(self) -> None:
        """Nobody waits for it."""


@runtime_checkable
class Ground(Protocol):
    """What scenarios are flown on, one after the other."""

    bus: str | None
    """None where the twin itself is commanded."""

    period_ms: int

    def stand(self, subject: FaultSubject, start: FlightStart) -> contextlib.AbstractContextManager[Stand]:
        """Ready for one flight."""
        ...


class TwinGround:
    """The twin itself."""

    bus: str | None = None
    period_ms = 1

    @contextlib.contextmanager
    def stand(self, subject: FaultSubject, start: FlightStart) -> Iterator[Stand]:
        """A new one."""
        yield TwinStand(subject, start)
