"""Guard's part of a replay, the same for a run in lock-step and a live run."""

from collections.abc import Sequence

import numpy as np

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError
from exograv.loop.control_step import AnsweringControl, ControlStep, Decision
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import GAIN_SD_KNOWN
from exograv.model.description import RigDescription
from exograv.recording.guard_state import state_in
from exograv.runtime.control_loop.exchange import ASTRAY, CONSENTED, DRIFTED, RESET, STOP_PRESSED, TOLD_LEVEL
from exograv.safety.envelope import Envelope
from exograv.safety.guard import SAFE_STATES, Guard, SafeState
from exograv.safety.limits import PersonLimits
from exograv.safety.native import core
from exograv.safety.person import GuardedPerson
from exograv.safety.state import VERSION, is_state, put_state
from exograv.safety.stops import StopReason
from exograv.signals import JointState

from .columns import Columns, ReplayedDecisions
from .recorded_run import GuardStates

SETTLED_S = 0.5
"""Time after a gap in which restarted filters differ from those of the run [s]. The observer needs 50 ms, and the
returned friction needs some motion."""


class GuardReplay:
    """Guard of one machine, replayed from the start of the run."""

    def __init__(
        self,
        description: RigDescription,
        actuators: ActuatorGain,
        period_s: float,
        person: PersonLimits | None = None,
        gravity_level: float = 0.0,
        levels: Sequence[tuple[float, float, float]] = (),
        *,
        takes_each: bool = False,
        is_other_run: bool = False,
    ):
        """Begin before the first tick.

        Args:
            description: The machine.
            actuators: Gains of its drives, as calibrated.
            period_s: Time between two ticks [s].
            person: Limits of the wearer; None if the machine is empty.
            gravity_level: Share of the arm's weight that the wearer feels at first [-].
            levels: Requests for a gravity level during the run: time [s], level [-] and duration of the ramp [s] each.
            takes_each: True if the guard took each request, in this order. A request may wait for some ticks, so its
                time alone does not say which one a tick took.
            is_other_run: True if something recorded is replaced. The replay then assumes that the motors follow its own
                commands, because the recorded currents answer to the commands of the run.
        """
        self._is_other_run, self._told_more = is_other_run, np.zeros(len(description.joints))
        self._levels, self._resumes = levels, False
        self._takes_each, self._taken = takes_each, 0
        self._description, self._actuators, self._period_s = description, actuators, period_s
        self._person, self._gravity_level, self._is_driven = person, gravity_level, False
        self._settles_at, self._is_blind = -np.inf, False
        self._states = GuardStates()
        self._has_lost = False
        self.forget(None)

    def forget(self, tau: np.ndarray | None) -> None:
        """Begin anew, from the torque `tau` (joint,) [N·m] if the motors give one."""
        envelope = Envelope(limits(self._description), self._period_s)
        if self._person is not None:
            envelope.person = GuardedPerson(self._person, self._gravity_level)
            envelope.person.drive(self._is_driven)
        if tau is not None:
            envelope.begin(tau)
        gain = self._actuators
        is_known = bool((gain.gain_sd <= GAIN_SD_KNOWN * np.abs(gain.gain)).all())
        self.guard = Guard.of_machine(envelope, self._period_s, gain.gain.tolist(), is_known)
        self._agree()
        self._step = ControlStep(self.guard, gain.gain)
        self.safe_state = SafeState.NONE
        self._stop: StopReason | None = None

    def _agree(self) -> None:
        """Give the consent without which the guard would end a level above 1: the wearer gave it in that run."""
        if self._gravity_level > 1.0:
            self.guard.consent()

    def wear(self, person: PersonLimits | None, gravity_level: float, is_driven: bool) -> None:
        """Set the wearer from this tick on; None for an empty machine."""
        self._person = person
        self.guard.envelope.person = None if person is None else GuardedPerson(person, gravity_level)
        self.feel(gravity_level, is_driven)

    def feel(self, gravity_level: float, is_driven: bool) -> None:
        """Set the felt share of the arm's weight and whether control drives the arm, for the same wearer."""
        self._gravity_level, self._is_driven = gravity_level, is_driven
        person = self.guard.envelope.person
        if person is not None:
            self._agree()
            person.gravity_level = gravity_level
            if person.is_driven != is_driven:  # The end of a motion limits the tank, a new level does not.
                person.drive(is_driven)

    @property
    def gravity_level(self) -> float:
        """Share of the arm's weight that the wearer feels in this tick [-]."""
        person = self.guard.envelope.person
        return self._gravity_level if person is None else person.gravity_level

    def know(self, states: GuardStates) -> None:
        """Take the recorded states of the guard."""
        self._states = states

    def persons_by(self, now: float) -> int:
        """Return how many persons the guard of a live run had been given by this tick; 0 if no state says so."""
        message = self._states.at(now)
        return 0 if message is None else message["persons"]

    def lose(self, k: int, columns: Columns) -> None:
        """Restart after a gap of ticks before tick `k`."""
        if self._levels and np.isfinite(level := columns.mode[k][1]):
            self._gravity_level, self._resumes = level, True
        self.forget(columns["tau_commanded"][k])
        self._settles_at = columns.t[k] + SETTLED_S
        self._is_blind = self._has_lost = True

    def take(self, k: int, columns: Columns, control: AnsweringControl, again: ReplayedDecisions) -> Decision:
        """Take one step, after applying the operator's acts since the last step."""
        if self._is_blind and columns.safe_state[k] <= SafeState.BRIDGE + 1:
            # The stop found after the gap is over. What the guard held before the gap is unknown.
            self._is_blind = False
            self.forget(columns["tau_commanded"][k])
        acts = columns.acts[k]
        if acts & RESET:
            self.guard.reset()
        if acts & STOP_PRESSED:
            self.guard.press_stop()
        if acts & ASTRAY:
            self.guard.envelope.trip(StopReason.ASTRAY)
        if acts & DRIFTED:
            self.guard.envelope.trip(StopReason.DRIFTED)
        if acts & CONSENTED:
            self.guard.consent()
        if acts & TOLD_LEVEL:
            self._taken += 1
            self._want_level(columns.now[k])
        now = columns.now[k]
        decision = self._step.take(self._state(k, columns), now, control)
        if self._resumes and not self._is_blind:
            self._want_level(now)  # The level is known up to the tick after the gap, so the request follows it.
        self._resumes = False
        self.safe_state = decision.safe_state
        self._told_more = decision.command.tau - columns["tau_commanded"][k]
        again.tau_commanded[k], again.safe_state[k] = decision.command.tau, decision.safe_state + 1
        again.knows_guard[k] = not self._is_blind and columns.t[k] >= self._settles_at
        was, stop = self._stop, decision.stop
        self._stop = stop
        if stop is not None and was is None:
            again.stops.append((columns.t[k], stop.value))
        self._look_at_state(now, again)
        return decision

    def _look_at_state(self, now: float, again: ReplayedDecisions) -> None:
        """Compare the guard with its recorded state after this tick; after a gap, go on with that state.

        Control's memory of the time before a gap is lost, so its later torques and the guard's states never agree to
        the last bit again.
        """
        message = self._states.at(now)
        if message is None or self._is_other_run:
            return
        if message["version"] != f"{VERSION:08x}":
            again.guard_version = message["version"]
            return
        record, state = self.guard.envelope.record, state_in(message)
        if not self._has_lost:
            if is_state(record, state):
                again.guard_equal += 1
            else:
                again.guard_differs.append(now)
            return
        try:
            put_state(record, state)
        except ConfigError:  # the message is damaged: the guard stays as unknown as after the gap
            again.guard_differs.append(now)
            return
        again.guard_restored += 1
        self._is_blind, self._settles_at = False, -np.inf
        self.safe_state = SAFE_STATES[int(record.numbers[core.SAFE_STATE])]
        self._stop = self.guard.envelope.stop  # it began in the gap, or in a tick that the replay has told

    def _state(self, k: int, columns: Columns) -> JointState:
        state, more = columns.state(k), self._told_more
        if not self._is_other_run:
            return state
        return state._replace(current=state.current + self._actuators.current(more), tau=state.tau + more)

    def _want_level(self, now: float) -> None:
        """Ask for the request that this tick took, or for the most recent one."""
        if self._takes_each:
            if self._taken:
                self.guard.feel(*self._levels[self._taken - 1][1:])
        elif asked := [(level, ramp_s) for t, level, ramp_s in self._levels if t <= now]:
            self.guard.feel(*asked[-1])
