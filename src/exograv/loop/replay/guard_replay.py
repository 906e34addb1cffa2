"""The guard's part of a replay, the same for a run in lock-step and a live one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.loop.control_step import AnsweringControl, ControlStep, Decision
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import GAIN_SD_KNOWN
from exograv.model.description import RigDescription
from exograv.runtime.control_loop.exchange import ASTRAY, RESET, STOP_PRESSED, TOLD_LEVEL
from exograv.safety.envelope import Envelope, StopReason
from exograv.safety.guard import Guard, SafeState
from exograv.safety.person import GuardedPerson, PersonLimits
from exograv.signals import JointState

from .columns import Columns, ReplayedDecisions

SETTLED_S = 0.5
"""After a gap, in which filters that began anew do not yet agree with those of the run [s]: the observer needs 50 ms,
the friction returned some motion."""


class GuardReplay:
    """One guard, from the beginning of its machine."""

    def __init__(
        self,
        description: RigDescription,
        actuators: ActuatorGain,
        period_s: float,
        person: PersonLimits | None = None,
        gravity_level: float = 0.0,
        levels: Sequence[tuple[float, float, float]] = (),
        *,
        is_other_run: bool = False,
    ):
        """It has seen nothing yet.

        Args:
            description: The machine.
            actuators: As calibrated.
            period_s: Between two ticks [s].
            person: Who is in it, if anybody.
            gravity_level: What that person feels of the arm's weight at first.
            levels: Gravity levels that were asked for while it ran: each after when [s], and by a ramp of how long [s].
            is_other_run: Whether something takes the place of what was recorded. The motors are then taken to follow
                what they are told this time: they answered to what they were told in the run.
        """
        self._is_other_run, self._told_more = is_other_run, np.zeros(len(description.joints))
        self._levels, self._resumes = levels, False
        self._description, self._actuators, self._period_s = description, actuators, period_s
        self._person, self._gravity_level, self._is_driven = person, gravity_level, False
        self._settles_at, self._is_blind = -np.inf, False
        self.forget(None)

    def forget(self, tau: np.ndarray | None) -> None:
        """Begin anew, from this torque (joint,) [N·m] where the motors give one."""
        envelope = Envelope(limits(self._description), self._period_s)
        if self._person is not None:
            envelope.person = GuardedPerson(self._person, self._gravity_level)
            envelope.person.drive(self._is_driven)
        if tau is not None:
            envelope.begin(tau)
        gain = self._actuators
        is_known = bool((gain.gain_sd <= GAIN_SD_KNOWN * np.abs(gain.gain)).all())
        self.guard = Guard.of_machine(envelope, self._period_s, gain.gain.tolist(), is_known)
        self._step = ControlStep(self.guard, gain.gain)
        self.safe_state = SafeState.NONE
        self._stop: StopReason | None = None

    def wear(self, person: PersonLimits | None, gravity_level: float, is_driven: bool) -> None:
        """Somebody else is in the machine from here on, or nobody."""
        self._person = person
        self.guard.envelope.person = None if person is None else GuardedPerson(person, gravity_level)
        self.feel(gravity_level, is_driven)

    def feel(self, gravity_level: float, is_driven: bool) -> None:
        """The same person is to feel another share of the arm's weight, or is moved or let go."""
        self._gravity_level, self._is_driven = gravity_level, is_driven
        person = self.guard.envelope.person
        if person is not None:
            person.gravity_level = gravity_level
            person.drive(is_driven)

    @property
    def gravity_level(self) -> float:
        """What the person feels of the arm's weight in this tick."""
        person = self.guard.envelope.person
        return self._gravity_level if person is None else person.gravity_level

    def lose(self, k: int, columns: Columns) -> None:
        """Ticks are missing before this one."""
        if self._levels and np.isfinite(level := columns.mode[k][1]):
            self._gravity_level, self._resumes = level, True
        self.forget(columns["tau_commanded"][k])
        self._settles_at = columns.t[k] + SETTLED_S
        self._is_blind = True

    def take(self, k: int, columns: Columns, control: AnsweringControl, again: ReplayedDecisions) -> Decision:
        """One step, after what was done to the guard since the last one."""
        if self._is_blind and columns.safe_state[k] <= SafeState.BRIDGE + 1:
            # A latch that was found after a gap is over; what the guard held before it is unknown.
            self._is_blind = False
            self.forget(columns["tau_commanded"][k])
        acts = columns.acts[k]
        if acts & RESET:
            self.guard.reset()
        if acts & STOP_PRESSED:
            self.guard.press_stop()
        if acts & ASTRAY:
            self.guard.envelope.trip(StopReason.ASTRAY)
        if acts & TOLD_LEVEL:
            self._want_level(columns.now[k])
        now = columns.now[k]
        decision = self._step.take(self._state(k, columns), now, control)
        if self._resumes and not self._is_blind:
            self._want_level(now)  # after the tick whose level is known
        self._resumes = False
        self.safe_state = decision.safe_state
        self._told_more = decision.command.tau - columns["tau_commanded"][k]
        again.tau_commanded[k], again.safe_state[k] = decision.command.tau, decision.safe_state + 1
        again.knows_guard[k] = not self._is_blind and columns.t[k] >= self._settles_at
        was, stop = self._stop, decision.stop
        self._stop = stop
        if stop is not None and was is None:
            again.stops.append((columns.t[k], stop.value))
        return decision

    def _state(self, k: int, columns: Columns) -> JointState:
        state, more = columns.state(k), self._told_more
        if not self._is_other_run:
            return state
        return replace(state, current=state.current + self._actuators.current(more), tau=state.tau + more)

    def _want_level(self, now: float) -> None:
        """Ask for the level that was asked for last."""
        if asked := [(level, ramp_s) for t, level, ramp_s in self._levels if t <= now]:
            self.guard.feel(*asked[-1])
