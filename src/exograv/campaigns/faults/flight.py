"""Flight of one scenario: a person in a machine, faults at their onsets, the guard between, and the resulting log.

The run is in lock-step. On the twin itself, the same seed gives the same run, bit for bit.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from exograv.loop.control_step import NO_MEASUREMENT, ControlStep, Decision
from exograv.loop.drift_monitor import DriftMonitor
from exograv.loop.native_ticks import NativeTicks
from exograv.loop.output_feedback import OutputFeedback
from exograv.motion import Trajectory
from exograv.rig.twin import TwinDivergedError
from exograv.safety.envelope import Envelope
from exograv.safety.guard import ControlRequest, Guard, SafeState
from exograv.safety.person import GuardedPerson
from exograv.safety.stops import StopReason
from exograv.signals import Command, JointState, Reference

from .fault_plant import FaultParticipant, FaultPlant, TruthSample
from .injector import Injector
from .oracle import EnvelopeOracle
from .person_faults import StopPressed
from .scenario_log import ScenarioLog, TruthWatch

Joints = Float[np.ndarray, " joint"]


SEGMENT_TICKS, KEPT_TICKS = 20_000, 400
"""Ticks after which a part of a long flight is judged and forgotten, and ticks that the next judgement still knows. The
oracle's bound on friction forgets a speed within 400 ticks (0.95^400 is below 10⁻⁸)."""


class FaultFlight:
    """Flight of one scenario."""

    def __init__(self, participant: FaultParticipant, stand: FaultPlant, posture: Joints, faults: Sequence[Injector]):
        """Begin with the arm floating in a posture.

        Args:
            participant: Participant in the machine, as the software knows them.
            stand: Machine and person, in that posture.
            posture: Start posture of the floating arm [rad].
            faults: Faults of the scenario.
        """
        prepared, period_s = participant.prepared, stand.period_s
        self._stand, self._controller = stand, participant.controller.again(prepared.x)
        self._person = GuardedPerson(participant.person)
        self._envelope = Envelope(participant.limits, period_s)
        self._envelope.person = self._person
        self._envelope.begin(self._controller.torque_at_rest(posture, prepared.x))
        gain = prepared.machine.actuators.gain
        self._guard = Guard.of_machine(self._envelope, period_s, gain.tolist())
        self._step, feedback = ControlStep(self._guard, gain), OutputFeedback(len(posture), period_s, self._controller)
        self._feedback, self._control = feedback, _FaultyControl(feedback, self._envelope)
        self._native = None if stand.rig is None else NativeTicks.of(stand.rig, self._guard, gain)
        self.is_native = False
        """True if ticks run in native code; the first ones never do, and those of a fault that changes signals."""
        self._gain = gain
        self._drift = DriftMonitor(self._controller, prepared.covariance, period_s, participant.model)
        self._oracle = EnvelopeOracle(participant.limits, participant.person, period_s)
        self._faults, still = faults, np.zeros((1, len(posture)))
        self._path = Trajectory(posture[None].copy(), still, still, period_s)
        self._reference = Reference(posture, still[0], still[0])
        # Native ticks do not keep the last command, which is sent again after the guard's death.
        changed = (0 if one.ends_guard else one.onset for one in faults if one.changes_signals or one.ends_guard)
        self._signals_from = min(changed, default=None)
        """First tick in which a fault may change a signal; None without such a fault."""
        self._last = Command(stand.t, NO_MEASUREMENT, stand.t, still[0], still[0])
        for fault in faults:
            fault.begin(stand)
        onset = min((fault.onset for fault in faults), default=None)
        self.watch = TruthWatch(onset, round(1e3 * period_s), participant.person.table)

    def fly(self, ticks: int, healthy: Sequence[TruthSample] = ()) -> ScenarioLog:
        """Run the control step for this number of ticks, and return the log, which also states an exception.

        Args:
            ticks: Number of ticks.
            healthy: True states in the same flight without its faults; empty if no criterion compares with them.
        """
        course = self.watch.course
        try:
            for tick in range(ticks):
                self._tick(tick)
                course.ticks += 1
        except Exception as error:  # noqa: BLE001 - a crash of the software is a finding of the campaign
            course.crashed = f"{type(error).__name__}: {error}"
            course.diverged = isinstance(error, TwinDivergedError)
        for fault in self._faults:
            fault.report(course)
        return self.watch.finish(self._oracle.judge(), self._stand.sights(), healthy)

    def fly_segment(self, ticks: int, kept: int) -> None:
        """Run up to this number of further ticks, or to the first stop, then judge them and forget all but the last.

        The figures of the log are those of `fly` only as far as ticks, stop, violations and an exception go.

        Args:
            ticks: Number of ticks.
            kept: Number of ticks that the oracle keeps for its next judgement.
        """
        course, before = self.watch.course, self._oracle.ticks
        try:
            for tick in range(course.ticks, course.ticks + ticks):
                self._tick(tick)
                course.ticks += 1
                if course.stopped_tick is not None:
                    break
        except Exception as error:  # noqa: BLE001 - a crash of the software is a finding of the campaign
            course.crashed = f"{type(error).__name__}: {error}"
            course.diverged = isinstance(error, TwinDivergedError)
        first = course.ticks - self._oracle.ticks
        new = {first + k: what for k, what in self._oracle.judge().wrong.items() if k >= before}
        course.violated_ticks += len(new)
        course.violations += [f"tick {tick}: {what}" for tick, what in new.items()][: 3 - len(course.violations)]
        self._oracle.forget(kept)
        self.watch.forget()

    def _tick(self, tick: int) -> None:
        stand, native = self._stand, self._native
        stand.begin()
        active = [fault for fault in self._faults if tick >= fault.onset]
        if not self._may_be_native(tick):
            native = None
            stand.read()  # before the faults act
        for fault in active:
            fault.act(self._stand, self._controller, tick)
            if isinstance(fault, StopPressed):
                self._guard.press_stop()
        self.watch.pushed(any(fault.pushes(tick) for fault in self._faults))
        if any(fault.ends_guard for fault in active):
            self.watch.commanded(tick, self._last.tau, SafeState.NONE, None)
            self._stand.go_on(self._last)
        elif native is not None and native.is_ready:
            self._natively(tick, native)
        else:
            self._guarded(tick, active, self._stand.read())

    def _may_be_native(self, tick: int) -> bool:
        """Return True if no fault changes a signal yet, and the observer has started."""
        if self._native is None or (self._signals_from is not None and tick >= self._signals_from):
            return False
        if not self.is_native:
            self.is_native = self._native.begin(self._feedback, self._controller, self._path)
        return self.is_native

    def _natively(self, tick: int, native: NativeTicks) -> None:
        """Run a tick in which no fault changes a signal, as `_guarded` does."""
        envelope = self._envelope
        believed = native.run(0, self._reference, 0, None)
        self._step.check_model(self._controller.closure_slope)
        self._look_for_drift(tick, believed)
        stop = envelope.stop
        isolated = frozenset() if stop is None else envelope.isolated
        tau = native.tau_commanded.copy()
        self._oracle.note(tau, believed and believed.q, isolated, self._person.gravity_level)
        self.watch.commanded(tick, tau, self._guard.safe_state, stop)

    def _guarded(self, tick: int, active: Sequence[Injector], state: JointState) -> None:
        now, sequence = self._stand.t, state.sequence
        for fault in active:
            state = fault.measured(state, tick)
        control = self._control
        control.faults, control.tick = active, tick
        decision = self._step.take(state, now, control)
        self._look_for_drift(tick, decision.believed)
        self._note(tick, decision, control.isolated)
        command = decision.command._replace(sequence=sequence)
        for fault in active:
            command = fault.commanded(command, tick)
        self._last = command
        self._stand.write(command)

    def _look_for_drift(self, tick: int, believed: JointState | None) -> None:
        """Let the arm down from the next tick on if the drift monitor says so, as a pilot does."""
        if believed is None or self._envelope.stop is not None:
            return
        finding = self._drift.take(believed.q, self._gain * believed.current)
        if finding is not None and not finding.stops:
            self.watch.warned(tick)
        elif finding is not None:
            self._envelope.trip(StopReason.DRIFTED)

    def _note(self, tick: int, decision: Decision, isolated: frozenset[int]) -> None:
        tau, q = decision.command.tau, None if decision.believed is None else decision.believed.q
        self._oracle.note(tau, q, isolated, self._person.gravity_level)
        self.watch.commanded(tick, tau, decision.safe_state, self._envelope.stop)


class _FaultyControl:
    """Control as in a session, with faults in its answers."""

    def __init__(self, feedback: OutputFeedback, envelope: Envelope):
        """Begin without an active fault."""
        self._feedback, self._envelope = feedback, envelope
        self._still = np.zeros_like(feedback.q)
        self.faults: Sequence[Injector] = ()
        """Faults that are active in this tick."""
        self.tick = 0
        self.isolated: frozenset[int] = frozenset()
        """Joints that were isolated when the guard accepted the measurement. A joint that the decision then finds too
        fast is not among them."""

    @property
    def closure_slope(self) -> float:
        """Slope of the controller's loops [N·m]."""
        return self._feedback.closure_slope

    def answer(self, believed: JointState | None, now: float) -> ControlRequest | None:
        """Observe and decide, then let the faults change the answer."""
        self.isolated, submitted = self._envelope.isolated, None
        if believed is not None:
            self._feedback.reference = Reference(believed.q, self._still, self._still)
            submitted = self._feedback.answer(believed, now)
        if submitted is not None:
            # A fault may keep the answer, and the controller overwrites its torque array in the next step.
            submitted = submitted._replace(tau=submitted.tau.copy())
        for fault in self.faults:
            submitted = fault.answered(submitted, self.tick)
        return submitted
