"""One scenario: a person in a machine, some faults at their times, the guard between, and what came of it.

The run is in lock-step on the twin's clock: the same seed gives the same run, bit for bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.control.observer import Observer
from exograv.rig.twin import Twin
from exograv.safety.envelope import Envelope, Limits, StopReason
from exograv.safety.guard import COMMAND_LIFE_S, Guard, Guarded, SafeState, Submitted
from exograv.safety.person import Person, PersonLimits
from exograv.session.arm_controller import ArmController
from exograv.session.pilot import CLOSURE_SLOPE_MAX
from exograv.session.prepare import Prepared
from exograv.session.virtual import VirtualLaboratory
from exograv.signals import Command, JointState, Reference

from .injectors import Injector, StopPressed
from .oracle import Oracle

Joints = Float[np.ndarray, " joint"]

SWAY_HZ, SWAY_STIFFNESS, SWAY_DAMPING = 0.8, 12.0, 1.5
"""Of a person who moves the arm [Hz, N·m/rad, N·m·s/rad]."""

MOVING_RAD_S = 0.2
"""Speed at which a fault that shows in motion has to show [rad/s]."""


@dataclass(frozen=True)
class Subject:
    """A person in a machine, known to the software as after an identification."""

    laboratory: VirtualLaboratory
    prepared: Prepared
    controller: ArmController
    limits: Limits
    person: PersonLimits


@dataclass
class Course:
    """What happened in one scenario."""

    ticks: int = 0
    violations: list[str] = field(default_factory=list)
    """What went out that should not have; the first ones, in words."""

    violated_ticks: int = 0
    stopped_tick: int | None = None
    reason: StopReason | None = None
    worst: SafeState = SafeState.NONE
    worst_tick: int | None = None
    """When that state came first."""

    moving_since: dict[int, int] = field(default_factory=dict)
    """Tick from the first onset on in which each joint was first clearly moving."""

    speed_at_onset: float = 0.0
    extra_speed: float = 0.0
    """By which a joint grew faster between the first onset and the safe state [rad/s]."""

    extra_way_deg: float = 0.0
    hand_m_s: float = 0.0
    """The hand's greatest speed from the safe state on."""

    told_Nm: np.ndarray | None = None
    """The most that each joint was told from the first onset on (joint,) [N·m]."""

    torque_step_Nm: float = 0.0
    """Greatest change of a command from one tick to the next after the first onset [N·m]."""

    crashed: str | None = None
    """The twin or the software gave up."""


class Flight:
    """Flies one scenario."""

    def __init__(self, subject: Subject, seed: int, posture: Joints, faults: Sequence[Injector], moves: Joints):
        """Begin with the arm floating in a posture.

        Args:
            subject: Who.
            seed: Of the twin's run.
            posture: Where the arm floats at first [rad].
            faults: What will go wrong.
            moves: The person's slow push at the joints, as amplitude of a sine [N·m]; zero for a relaxed person.
        """
        laboratory, prepared = subject.laboratory, subject.prepared
        self._twin = Twin(
            laboratory.description, laboratory.machine, laboratory.wearer, seed, start_posture=posture, t0=prepared.t
        )
        self._controller = subject.controller.again(prepared.x)
        self._gain = prepared.machine.actuators
        joints, period_s = len(posture), self._twin.period_s
        self._observer = Observer(joints, period_s)
        self._person = Person(subject.person)
        self._envelope = Envelope(subject.limits, period_s)
        self._envelope.person = self._person
        self._envelope.begin(self._controller.torque_at_rest(posture, prepared.x))
        self._guard = Guard.of_machine(self._envelope, period_s, self._gain.gain.tolist())
        self._oracle = Oracle(subject.limits, subject.person, period_s)
        self._faults, self._moves, self._own = faults, moves, np.zeros_like(self._twin.tau_voluntary)
        self._held_at = self._twin.truth.q_arm.copy()
        self._still = np.zeros(joints)
        self._onset = min((fault.onset for fault in faults), default=None)
        self.course = Course()

    def fly(self, ticks: int) -> Course:
        """So many ticks; whatever breaks is part of the course."""
        try:
            for tick in range(ticks):
                self._tick(tick)
        except Exception as error:  # noqa: BLE001 - a scenario that breaks the software is a finding, not an end
            self.course.crashed = f"{type(error).__name__}: {error}"
        return self.course

    def _tick(self, tick: int) -> None:
        active = [fault for fault in self._faults if tick >= fault.onset]
        self._move(tick)
        for fault in active:
            fault.act(self._twin, self._controller, tick)
            if isinstance(fault, StopPressed):
                self._guard.press_stop()
        state, now = self._twin.read(), self._twin.t
        truth = state
        for fault in active:
            state = fault.measured(state, tick)
        believed = self._guard.see(state, now)
        submitted = self._answer(believed, now)
        for fault in active:
            submitted = fault.answered(submitted, tick)
        guarded = self._guard.decide(submitted, now)
        self._judge(tick, believed, guarded, truth)
        tau, until = guarded.tau, now + COMMAND_LIFE_S
        command = Command(now, truth.sequence, until, tau, self._gain.current(tau), guarded.drive_damping)
        for fault in active:
            command = fault.commanded(command, tick)
        self._twin.write(command)
        self.course.ticks += 1

    def _move(self, tick: int) -> None:
        """The person sways the arm about where it was: a slow push, held back; beside whatever else pushes."""
        if self._moves.any():
            seen, phase = self._twin.truth, 2.0 * np.pi * SWAY_HZ * self._twin.period_s * tick
            own = (
                self._moves * np.sin(phase) - SWAY_STIFFNESS * (seen.q_arm - self._held_at) - SWAY_DAMPING * seen.v_arm
            )
            self._twin.tau_voluntary += own - self._own
            self._own = own

    def _answer(self, believed: JointState | None, now: float) -> Submitted | None:
        """Control: observes and decides, as in a session."""
        if believed is None:
            return None
        self._observer.update(believed.q)
        hold = Reference(believed.q, self._still, self._still)
        tau = self._controller.step(self._observer.q, self._observer.v, hold)
        if not self._controller.closure_slope < CLOSURE_SLOPE_MAX:
            self._guard.lose_model()
        return Submitted(believed.sequence, now + COMMAND_LIFE_S, tau.copy())

    def _judge(self, tick: int, believed: JointState | None, guarded: Guarded, truth: JointState) -> None:
        course, envelope = self.course, self._envelope
        found = self._oracle.judge(guarded.tau, believed, envelope.isolated, self._person.gravity_level)
        if found:
            course.violated_ticks += 1
            course.violations = [*course.violations, f"tick {tick}: {found}"][:3]
        if envelope.stop is not None and course.stopped_tick is None:
            course.stopped_tick, course.reason = tick, envelope.stop
        if guarded.safe_state > course.worst:
            course.worst, course.worst_tick = guarded.safe_state, tick
        if self._onset is not None and tick >= self._onset:
            self._watch_motion(tick, self._onset, truth)
            course.torque_step_Nm = max(course.torque_step_Nm, self._oracle.step_Nm)
            told = np.abs(guarded.tau)
            course.told_Nm = told if course.told_Nm is None else np.maximum(course.told_Nm, told)

    def _watch_motion(self, tick: int, onset: int, truth: JointState) -> None:
        """By the twin's truth: the examiner's business, nobody flies by it."""
        course, seen = self.course, self._twin.truth
        speed = np.abs(seen.v)
        if tick == onset:
            self._q_onset, self._v_onset = seen.q.copy(), seen.v.copy()
        for joint in np.flatnonzero(speed > MOVING_RAD_S).tolist():
            course.moving_since.setdefault(joint, tick)
        if course.stopped_tick is None:
            course.extra_speed = max(course.extra_speed, float(np.abs(seen.v - self._v_onset).max()))
            course.extra_way_deg = max(course.extra_way_deg, float(np.rad2deg(np.abs(seen.q - self._q_onset).max())))
        else:
            course.hand_m_s = max(course.hand_m_s, self._twin.hand_speed())
