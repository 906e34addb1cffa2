"""One scenario: a person in a machine, some faults at their times, the guard between, and what came of it.

The run is in lock-step on the twin's clock: the same seed gives the same run, bit for bit.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.control.observer import Observer
from exograv.rig.twin import Truth, Twin
from exograv.safety.envelope import Envelope, Limits
from exograv.safety.guard import COMMAND_LIFE_S, Guard, Guarded, SafeState, Submitted
from exograv.safety.person import Person, PersonLimits
from exograv.session.arm_controller import ArmController
from exograv.session.pilot import CLOSURE_SLOPE_MAX
from exograv.session.prepare import Prepared
from exograv.session.virtual import VirtualLaboratory
from exograv.signals import Command, JointState, Reference

from .course import Course, Watch
from .injector import Injector
from .of_person import StopPressed
from .oracle import Oracle

Joints = Float[np.ndarray, " joint"]

SWAY_HZ, SWAY_STIFFNESS, SWAY_DAMPING = 0.8, 12.0, 1.5
"""Of a person who moves the arm [Hz, N·m/rad, N·m·s/rad]."""

RELEASE_TICKS = 100
"""After a push, in which the braked hand loses what the push gave it [-]."""


@dataclass(frozen=True)
class Subject:
    """A person in a machine, known to the software as after an identification."""

    laboratory: VirtualLaboratory
    prepared: Prepared
    controller: ArmController
    limits: Limits
    person: PersonLimits


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
        self._pushed_tick = -RELEASE_TICKS - 1
        self._still = np.zeros(joints)
        self._last = Command(self._twin.t, -1, self._twin.t, self._still, self._still)
        self.watch = Watch(min((fault.onset for fault in faults), default=None))

    def fly(self, ticks: int) -> Course:
        """So many ticks; whatever breaks is part of the course."""
        course = self.watch.course
        try:
            for tick in range(ticks):
                self._tick(tick)
                course.ticks += 1
        except Exception as error:  # noqa: BLE001 - a scenario that breaks the software is a finding, not an end
            course.crashed = f"{type(error).__name__}: {error}"
        return self.watch.finish(self._oracle.judge())

    def _tick(self, tick: int) -> None:
        active = [fault for fault in self._faults if tick >= fault.onset]
        seen = self._twin.truth if active or self._moves.any() else None
        if seen is not None:
            self._move(tick, seen)
        for fault in active:
            fault.act(self._twin, self._controller, tick)
            if isinstance(fault, StopPressed):
                self._guard.press_stop()
        if any(fault.ends_guard for fault in active):
            self._go_on_without_guard(tick, seen)
        else:
            self._guarded(tick, active, seen)
        if active and self.watch.course.braked_tick is None and (self._twin.drive_damping() > 0.0).all():
            self.watch.course.braked_tick = tick + 1

    def _go_on_without_guard(self, tick: int, seen: Truth | None) -> None:
        """The drives have what they heard last."""
        self.watch.commanded(tick, self._last.tau, SafeState.NONE, None)
        self._look(tick, seen)
        self._twin.write(self._last)

    def _guarded(self, tick: int, active: Sequence[Injector], seen: Truth | None) -> None:
        state, now = self._twin.read(), self._twin.t
        truth = state
        for fault in active:
            state = fault.measured(state, tick)
        believed = self._guard.see(state, now)
        submitted = self._answer(believed, now)
        for fault in active:
            submitted = fault.answered(submitted, tick)
        guarded = self._guard.decide(submitted, now)
        self._note(tick, believed, guarded)
        self._look(tick, seen)
        tau, until = guarded.tau, now + COMMAND_LIFE_S
        command = Command(now, truth.sequence, until, tau, self._gain.current(tau), guarded.drive_damping)
        for fault in active:
            command = fault.commanded(command, tick)
        self._last = command
        self._twin.write(command)

    def _move(self, tick: int, seen: Truth) -> None:
        """The person sways the arm about where it was: a slow push, held back; beside whatever else pushes."""
        if self._moves.any():
            phase = 2.0 * np.pi * SWAY_HZ * self._twin.period_s * tick
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

    def _note(self, tick: int, believed: JointState | None, guarded: Guarded) -> None:
        envelope, q = self._envelope, None if believed is None else believed.q
        self._oracle.note(guarded.tau, q, envelope.isolated, self._person.gravity_level)
        self.watch.commanded(tick, guarded.tau, guarded.safe_state, envelope.stop)

    def _look(self, tick: int, seen: Truth | None) -> None:
        """By the twin's truth: the examiner's business."""
        watch = self.watch
        if any(fault.pushes(tick) for fault in self._faults):
            self._pushed_tick = tick
        if seen is not None:
            watch.moved(tick, seen)
        if watch.course.stopped_tick is not None or watch.course.braked_tick is not None:
            watch.hand(self._twin.hand_speed(), tick - self._pushed_tick <= RELEASE_TICKS)
