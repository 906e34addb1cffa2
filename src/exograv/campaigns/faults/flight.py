"""One scenario: a person in a machine, some faults at their times, the guard between, and what came of it.

The run is in lock-step: on the twin itself the same seed gives the same run, bit for bit.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from exograv.control.observer import Observer
from exograv.loop.control_step import CLOSURE_SLOPE_MAX
from exograv.safety.envelope import Envelope
from exograv.safety.guard import COMMAND_LIFE_S, Guard, Guarded, SafeState, Submitted
from exograv.safety.person import GuardedPerson
from exograv.signals import Command, JointState, Reference

from .fault_plant import FaultSubject, Stand
from .injector import Injector
from .oracle import EnvelopeOracle
from .person_faults import StopPressed
from .scenario_log import ScenarioLog, TruthWatch

Joints = Float[np.ndarray, " joint"]


class FaultFlight:
    """Flies one scenario."""

    def __init__(self, subject: FaultSubject, stand: Stand, posture: Joints, faults: Sequence[Injector]):
        """Begin with the arm floating in a posture.

        Args:
            subject: Who.
            stand: Machine and person, in that posture.
            posture: Where the arm floats at first [rad].
            faults: What will go wrong.
        """
        prepared, period_s = subject.prepared, stand.period_s
        self._stand, self._controller = stand, subject.controller.again(prepared.x)
        self._gain = prepared.machine.actuators
        self._observer = Observer(len(posture), period_s)
        self._person = GuardedPerson(subject.person)
        self._envelope = Envelope(subject.limits, period_s)
        self._envelope.person = self._person
        self._envelope.begin(self._controller.torque_at_rest(posture, prepared.x))
        self._guard = Guard.of_machine(self._envelope, period_s, self._gain.gain.tolist())
        self._oracle = EnvelopeOracle(subject.limits, subject.person, period_s)
        self._faults, self._still = faults, np.zeros(len(posture))
        self._last = Command(stand.t, -1, stand.t, self._still, self._still)
        self.watch = TruthWatch(min((fault.onset for fault in faults), default=None), round(1e3 * period_s))

    def fly(self, ticks: int) -> ScenarioLog:
        """So many ticks; whatever breaks is part of the course."""
        course = self.watch.course
        try:
            for tick in range(ticks):
                self._tick(tick)
                course.ticks += 1
        except Exception as error:  # noqa: BLE001 - a scenario that breaks the software is a finding, not an end
            course.crashed = f"{type(error).__name__}: {error}"
        return self.watch.finish(self._oracle.judge(), self._stand.sights())

    def _tick(self, tick: int) -> None:
        state = self._stand.read()
        active = [fault for fault in self._faults if tick >= fault.onset]
        for fault in active:
            fault.act(self._stand, self._controller, tick)
            if isinstance(fault, StopPressed):
                self._guard.press_stop()
        self.watch.pushed(any(fault.pushes(tick) for fault in self._faults))
        if any(fault.ends_guard for fault in active):
            self.watch.commanded(tick, self._last.tau, SafeState.NONE, None)
            self._stand.go_on(self._last)
        else:
            self._guarded(tick, active, state)

    def _guarded(self, tick: int, active: Sequence[Injector], state: JointState) -> None:
        now, sequence = self._stand.t, state.sequence
        for fault in active:
            state = fault.measured(state, tick)
        believed = self._guard.see(state, now)
        # Who is found too fast by what goes out is isolated after this posture was believed, and stays where it was.
        isolated = self._envelope.isolated
        submitted = self._answer(believed, now)
        for fault in active:
            submitted = fault.answered(submitted, tick)
        guarded = self._guard.decide(submitted, now)
        self._note(tick, believed, isolated, guarded)
        tau, until = guarded.tau, now + COMMAND_LIFE_S
        command = Command(now, sequence, until, tau, self._gain.current(tau), guarded.drive_damping)
        for fault in active:
            command = fault.commanded(command, tick)
        self._last = command
        self._stand.write(command)

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

    def _note(self, tick: int, believed: JointState | None, isolated: frozenset[int], guarded: Guarded) -> None:
        envelope, q = self._envelope, None if believed is None else believed.q
        self._oracle.note(guarded.tau, q, isolated, self._person.gravity_level)
        self.watch.commanded(tick, guarded.tau, guarded.safe_state, envelope.stop)
