"""Plant of a fault scenario: a machine to read and command, faults in it, and its truth for the examiner."""

import contextlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import Parameters
from exograv.errors import RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits import limits_of_table
from exograv.loop.plausible_table import TableMaker
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.rig import Rig
from exograv.rig.twin import Truth, Twin
from exograv.safety.limits import Limits, PersonLimits
from exograv.signals import Command, JointState

Joints = Float[np.ndarray, " joint"]

SWAY_HZ, SWAY_STIFFNESS, SWAY_DAMPING = 0.8, 12.0, 1.5
"""Frequency, stiffness and damping of a wearer who moves the arm [Hz, N·m/rad, N·m·s/rad]."""

POLE_COSINE = 0.5
"""Cosine of the abduction below which the pole of the shoulder's angles is near [-]."""


@dataclass(frozen=True)
class FaultParticipant:
    """Participant in a machine, known to the software as after an identification."""

    laboratory: VirtualLaboratory
    prepared: ControllerKnowledge
    controller: ArmController
    limits: Limits
    person: PersonLimits
    strangers: Float[np.ndarray, "person phi"]
    """Inertial parameters of other persons' arms in this machine, without error."""

    @cached_property
    def model(self) -> ArmModel:
        """Model of the arm in the machine, for drift monitors; made at the first use."""
        return ArmModel(self.prepared.assembly, self.prepared.machine)

    @cached_property
    def _tables(self) -> TableMaker:
        """Maker of the guard's tables, made at the first use: it takes seconds."""
        return TableMaker(self.prepared.assembly, self.prepared.machine, self.prepared.x)

    def limits_with(self, x: Parameters) -> PersonLimits:
        """Limits of the guard for other arm parameters in this machine."""
        return limits_of_table(self.prepared.assembly, self._tables.table(x))


class FlightStart(NamedTuple):
    """Start of a flight."""

    seed: int
    """Seed of the twin's run."""

    posture: Joints
    """Joint positions at the start [rad]."""

    moves: Joints
    """Amplitude of the wearer's sinusoidal push at the joints [N·m]; zero for a relaxed wearer."""

    hz: float = SWAY_HZ
    """Frequency of that push [Hz]."""


class TruthSample(NamedTuple):
    """Truth of the twin at one moment, for the examiner only."""

    q: Joints
    """Joint positions [rad]."""

    v: Joints
    """Joint velocities [rad/s]."""

    hand_m_s: float
    are_braking: bool
    """True if all drives have braked by themselves since the previous sample."""


@runtime_checkable
class World(Protocol):
    """Effects that a fault may have on machine and wearer."""

    @property
    def q(self) -> Joints:
        """Positions as measured last [rad]."""
        ...

    def push(self, joint: int, torque: float) -> None:
        """Add a torque of the wearer's muscles from now on [N·m]."""
        ...

    def hang(self, mount: str, mass_kg: float) -> None:
        """Attach a weight to this mount."""
        ...

    def turn_motor(self, joint: int, factor: float) -> None:
        """Scale the torque constant of a motor from now on."""
        ...

    def feel_gravity(self, g: Float[np.ndarray, " 3"]) -> None:
        """Let the machine feel this specific force from now on, along the axes of a level base [-]."""
        ...

    def slide_cuff(self, name: str, along_m: float) -> None:
        """Move the rest place of a cuff along the limb, away from where it was fastened [m]."""
        ...

    def at_bench(self, word: str, joint: int | None = None, number: float | None = None) -> None:
        """Obey a command of the simulated drives' bench (`exograv dev drive-sim`, help)."""
        ...

    def is_silent(self) -> None:
        """Note that the drives will not answer any more, so that a run in lock-step does not wait for them."""
        ...


@runtime_checkable
class FaultPlant(World, Protocol):
    """Machine in lock-step, with the wearer in it."""

    @property
    def t(self) -> float:
        """Time on the plant's clock [s]."""
        ...

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        ...

    @property
    def rig(self) -> Rig | None:
        """Machine whose ticks may run in native code; None behind a driver."""
        ...

    def begin(self) -> None:
        """Begin a tick: the examiner looks at the true state, and the wearer moves."""
        ...

    def read(self) -> JointState:
        """Return the measurement of the tick."""
        ...

    def write(self, command: Command) -> None:
        """Send the command and end the tick."""
        ...

    def go_on(self, last: Command) -> None:
        """End the tick without a controller; `last` is the last command that the drives received."""
        ...

    def sights(self) -> list[TruthSample]:
        """Return the true state of machine and arm in every tick, after the flight."""
        ...

    def forget(self) -> None:
        """Forget the truth of past ticks."""
        ...


class SwayingWearer:
    """Twin whose wearer sways the arm about its start: a sinusoidal push, added to other torques."""

    def __init__(self, twin: Twin, start: FlightStart):
        """Hold the twin's present posture, and push as the start says."""
        self.twin, self._moves, self._hz = twin, start.moves, start.hz
        self._own = np.zeros_like(twin.tau_voluntary)
        self._held_at, self._steps = twin.truth.q_arm.copy(), 0
        self._is_still = not start.moves.any()
        self._poles = poles_of(twin.truth)

    def look(self) -> TruthSample:
        """Return the twin's true state at this moment."""
        q, v = self.twin.motion()
        return TruthSample(q, v, self.twin.hand_speed(), min(self.twin.drive_damping().tolist()) > 0.0)

    def sway(self) -> None:
        """Set the muscle torque for the next step of the twin."""
        if not self._is_still:
            q_arm, v_arm = self.twin.arm_motion()
            phase = 2.0 * np.pi * self._hz * self.twin.period_s * self._steps
            own = self._moves * np.sin(phase) - SWAY_STIFFNESS * (q_arm - self._held_at) - SWAY_DAMPING * v_arm
            weaken_near_poles(own, q_arm, self._poles)
            self.twin.tau_voluntary += own - self._own
            self._own = own
        self._steps += 1


def poles_of(truth: Truth) -> tuple[int, ...]:
    """Return the place of the first freedom, flexion, of each arm whose shoulder has a pole."""
    poles, first = list[int](), 0
    for arm in truth.wearer.arms if truth.wearer else ():
        if arm.skeleton.is_usual:
            poles.append(first)
        first += len(arm.skeleton.freedoms)
    return tuple(poles)


def weaken_near_poles(tau: Float[np.ndarray, " arm"], q_arm: Float[np.ndarray, " arm"], poles: Sequence[int]) -> None:
    """Reduce the muscle torque of flexion and rotation [N·m] near the poles of the shoulders' angles.

    Near 90° of abduction both angles turn against each other without moving the arm, so a muscle cannot resist it. The
    damping of `SWAY_DAMPING`, held for a tick, would drive that motion instead of braking it.
    """
    for first in poles:
        cosine = abs(np.cos(q_arm[first + 1]))
        share = min(1.0, (cosine / POLE_COSINE) ** 2)
        tau[first] *= share
        tau[first + 2] *= share


def twin_of(laboratory: VirtualLaboratory, start: FlightStart, t0: float) -> Twin:
    """Put the wearer into the machine at the start posture, at time `t0` of the rig's clock [s]."""
    return laboratory.twin(start.seed, t0, start.posture)


class TwinPlant:
    """Fault plant made of the twin itself, in this process."""

    def __init__(self, participant: FaultParticipant, start: FlightStart, *, keeps_truth: bool = True):
        """Put the wearer into the machine. Without `keeps_truth` there are no sights, and a tick is cheaper."""
        self._twin = twin_of(participant.laboratory, start, participant.prepared.t)
        self._person, self._sights = SwayingWearer(self._twin, start), list[TruthSample]()
        self._keeps_truth = keeps_truth

    @property
    def t(self) -> float:
        """Time on the twin's clock [s]."""
        return self._twin.t

    @property
    def period_s(self) -> float:
        """Time between two measurements [s]."""
        return self._twin.period_s

    @property
    def rig(self) -> Rig | None:
        """Machine whose ticks may run in native code: the twin."""
        return self._twin

    def begin(self) -> None:
        """Note the truth for the examiner, and let the wearer move."""
        if self._keeps_truth:
            self._sights.append(self._person.look())
        self._person.sway()

    def read(self) -> JointState:
        """Return the measurement of the tick."""
        return self._twin.read()

    def write(self, command: Command) -> None:
        """Send the command and end the tick."""
        self._twin.write(command)

    def go_on(self, last: Command) -> None:
        """Advance the twin with the last command, which expires soon."""
        self._twin.write(last)

    def forget(self) -> None:
        """Forget the truth of past ticks."""
        self._sights.clear()

    def sights(self) -> list[TruthSample]:
        """Truth of every tick, and of the end of the last one."""
        return [*self._sights, self._person.look()]

    @property
    def q(self) -> Joints:
        """Positions as measured last [rad]."""
        return self._twin.read().q

    def push(self, joint: int, torque: float) -> None:
        """Add a torque of the wearer's muscles."""
        self._twin.tau_voluntary[joint] += torque

    def hang(self, mount: str, mass_kg: float) -> None:
        """Attach the weight at once."""
        self._twin.hang(mount, mass_kg)

    def turn_motor(self, joint: int, factor: float) -> None:
        """Scale the motor's torque constant. Status and measurement of the motor change with it."""
        self._twin.turn_motor(joint, factor)

    def feel_gravity(self, g: Float[np.ndarray, " 3"]) -> None:
        """Turn gravity, as a tilted base does."""
        self._twin.fly(g)

    def slide_cuff(self, name: str, along_m: float) -> None:
        """Slide the cuff along the limb."""
        self._twin.slide_cuff(name, along_m)

    def at_bench(self, word: str, joint: int | None = None, number: float | None = None) -> None:
        """Reject the command: the twin has no bench.

        Raises:
            RigError: Always.
        """
        raise RigError(f"'{word}' needs simulated drives; this twin has none. Fly the scenario through a driver.")

    def is_silent(self) -> None:
        """Do nothing, because the twin never waits for answers."""


@runtime_checkable
class PlantSource(Protocol):
    """Source of plants for scenarios, one after the other."""

    bus: str | None
    """Name of the bus; None where the twin itself is commanded."""

    period_ms: int

    def stand(self, participant: FaultParticipant, start: FlightStart) -> contextlib.AbstractContextManager[FaultPlant]:
        """Prepare a plant for one flight."""
        ...


class TwinPlants:
    """Plants made of the twin itself."""

    bus: str | None = None
    period_ms = 1

    def __init__(self, *, keeps_truth: bool = True):
        """Make plants; without `keeps_truth` they have no sights, and a tick is cheaper."""
        self._keeps_truth = keeps_truth

    @contextlib.contextmanager
    def stand(self, participant: FaultParticipant, start: FlightStart) -> Iterator[FaultPlant]:
        """Build a new twin for one flight, for use in a `with` block."""
        yield TwinPlant(participant, start, keeps_truth=self._keeps_truth)
