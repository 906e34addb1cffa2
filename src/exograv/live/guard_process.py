"""Guard process of the live loop: it owns the machine, and control only submits torques to it.

Guard and control share two mailboxes: the state that the guard believes, and the answer of control. The guard waits
for an answer during a part of the period, never longer. A late or missing answer is a normal case, not an error.
"""

import contextlib
import time
from dataclasses import replace
from multiprocessing.connection import Connection

import numpy as np

from exograv.loop.control_step import ControlStep
from exograv.loop.drift_finding import DriftFinding
from exograv.recording.encoding import tick_dtype
from exograv.rig import Powered, Rig, may_be_worn
from exograv.rig.drives.clock import DrivesEndedError
from exograv.rig.drives.opening import DrivenRig
from exograv.runtime.clock.host import loop_cpus
from exograv.runtime.clock.real_time_loop import run_loop
from exograv.runtime.clock.realtime import GUARD_PRIORITY, PRIORITY, Rights, realtime
from exograv.runtime.clock.timing import LoopOutcome, Timing
from exograv.runtime.control_loop.exchange import DRIFTED, UNANSWERED, answer_dtype, state_dtype
from exograv.runtime.control_loop.guard_commands import ENDS, GuardCommands, GuardInbox
from exograv.runtime.processes.shared_memory import Mailbox
from exograv.runtime.recorder.recorder_process import PHASE, event
from exograv.safety.guard import ControlRequest, SafeState
from exograv.safety.modes import Mode
from exograv.safety.stops import StopReason
from exograv.signals import JointState

from .guard_job import (
    ASKED_AGAIN_EVERY,
    GIVEN_UP_AFTER,
    LOOK_S,
    TIME_IS_OVER,
    WAITS_NS,
    GuardedRig,
    GuardJob,
    GuardReport,
    StopLatch,
    answer_by_ns,
    reported,
)
from .guard_states import GuardStates
from .native_guard import native_guard

LOST_AFTER = 50
"""Ticks in a row in which the machine could not be read or written after an error, and the run ends."""


class SilentControl:
    """Control that does not answer: the guard lets the arm down without it."""

    closure_slope = 0.0

    def answer(self, believed: JointState | None, now: float) -> None:
        """Return None in every tick."""


def guard_process(job: GuardJob, parent: Connection) -> None:
    """Run the guard process: build the machine, report "ready", wait for "go", run the loop, send the report."""
    made = job.build()
    guarding = native_guard(job, parent, made) or GuardLoop(job, parent, made)
    try:
        with guarding.rig:
            show_posture(guarding.rig, job)
            parent.send("ready")
            try:
                parent.recv()
            except EOFError:  # the parent has ended before the start
                return
            report = guarding.report(*guarding.run())
        with contextlib.suppress(OSError):  # The parent process has ended.
            parent.send(report)
    finally:
        guarding.close()


def show_posture(rig: Rig, job: GuardJob) -> None:
    """Tell control the posture of the machine before the motors are on, so that its first answer comes in time."""
    with contextlib.closing(Mailbox(state_dtype(job.channels.joints), job.channels.states)) as states:
        measured, state = rig.read(), np.zeros((), state_dtype(job.channels.joints))
        state["sequence"], state["now"], state["safe_state"] = measured.sequence, rig.t, SafeState.NONE
        state["q"], state["current"] = measured.q, measured.current
        states.write(state)


class GuardLoop:
    """State of the guard process and the tick of its loop, in Python."""

    def __init__(self, job: GuardJob, parent: Connection, made: GuardedRig):
        self._job = job
        self.rig, self._guard, self._gain = made.rig, made.guard, made.gain
        self._step, self._answer, self._woken = ControlStep(made.guard, made.gain), None, 0
        self.closure_slope = 0.0
        """Residual slope of the cuff energy in the answer of control [N·m]; 0 without an answer."""
        channels, self._announce = job.channels, made.announce
        self._states = Mailbox(state_dtype(channels.joints), channels.states)
        self._answers = Mailbox(answer_dtype(channels.joints), channels.answers)
        self._ticks, self._events = channels.inlet.ticks(), channels.inlet.events()
        self._guard_states = GuardStates(channels.inlet, made.guard.envelope.record)
        self._inbox = GuardInbox(channels.parent, parent)
        self.hearing = GuardCommands(self._guard, self._inbox, self._note)
        self._known_modes = [Mode.__members__.get(name.upper()) for name in job.mode_names]
        self._state, self._row = np.zeros((), state_dtype(channels.joints)), np.zeros((), tick_dtype(channels.joints))
        self._row["cdr_header"] = (0, 1, 0, 0)
        for name in ("q_reference", "v_reference", "a_reference"):
            self._row[name] = np.nan
        self._safe_state, self._phase, self._mode = SafeState.NONE, 0, -1
        self._latches: list[StopLatch] = []
        self._modes: list[tuple[str, float]] = []
        self._unanswered = self._silent = self._started_ns = 0
        self._has_begun = self._was_stopped = self._is_time_over = False
        self._started_t = 0.0
        self._lost, self.failure, self._drift_known = 0, "", 0
        # A latch of a real machine ends the run: the operator inspects the machine and repeats its self-test first.
        self._ends_stopped = may_be_worn(self.rig)
        self._resets = not (self._ends_stopped or job.is_steered)
        # Simulated drives in lock-step wait for this loop, so that a pause of the computer is none of the machine.
        self._is_awaited = isinstance(made.rig, DrivenRig) and made.rig.is_in_lock_step
        # A control that has been given up must not stretch the descent, also if the drives would wait for it.
        self._given_up_by_ns = answer_by_ns(job.period_ns)
        self._answer_by_ns = WAITS_NS if self._is_awaited else self._given_up_by_ns

    def run(self) -> tuple[Timing, Rights]:
        """Switch the motors on and run the loop to its end.

        Raises:
            RigError: A drive stays off.
        """
        # A twin computes its physics in this process. On a computer with one processor, a higher priority would leave
        # control too little time, and nobody is in a twin.
        with realtime(loop_cpus().guard, GUARD_PRIORITY if self._ends_stopped else PRIORITY) as rights:
            periods = self._job.periods_with_descent(self.rig)
            timing = run_loop(self.tick, periods, self._job.period_ns, begin=self.begin, is_awaited=self._is_awaited)
            if self._is_time_over and timing.outcome is LoopOutcome.ENDED_EARLY:
                timing = replace(timing, outcome=LoopOutcome.COMPLETE)
            return timing, rights

    def begin(self) -> None:
        """Switch the motors on.

        Raises:
            RigError: A drive stays off.
        """
        if isinstance(self.rig, Powered):
            self.rig.enable()

    def tick(self, period: int) -> bool:
        """Run one tick; return True to end the loop early. After an error, the guard alone lets the arm down.

        Simulated drives that do not answer any more end the run at once.

        Raises:
            Exception: The machine could not be read or written in `LOST_AFTER` ticks in a row. The watchdogs of its
                drives brake the arm.
        """
        if not self.failure:
            try:
                return self._tick(period)
            except DrivesEndedError as error:
                self.failure = str(error)
                self._note(self.rig.t, self.failure)
                return True
            except Exception as error:  # noqa: BLE001 - of any error the arm comes down softly
                self.failure = reported(error)
                self.hearing.press_stop()
                with contextlib.suppress(Exception):
                    self._note(self.rig.t, self.failure)
        return self._lower(period)

    def _lower(self, period: int) -> bool:
        """Run a tick of the descent after an error; return True at its end."""
        woken = self._woke(period)
        try:
            state, now = self.rig.read(), self.rig.t
            self._row["monotonic"] = 1e-9 * time.monotonic_ns()  # as in `_tick`
            decision = self._step.take(state, now, SilentControl())
            self.rig.write(decision.command)
        except DrivesEndedError:
            return True
        except Exception:
            self._lost += 1
            if self._lost >= LOST_AFTER:
                raise
            return False
        self._lost, self._safe_state = 0, decision.safe_state
        with contextlib.suppress(Exception):  # the error may be in what records
            self._look_for_stops(period, now, decision.stop)
            self._record(period, now, state, decision.command.tau, None, woken)
        return self._guard.envelope.descent_is_over

    def _tick(self, period: int) -> bool:
        """Read the machine, request an answer, decide, write the command, record; return True to end the loop early."""
        woken = self._woke(period)
        state, now = self.rig.read(), self.rig.t
        if not self._has_begun:
            # Begin at the present motor torque, in the recorded form, so that a replay begins at the same value.
            self._guard.envelope.begin(self._gain * state.current)
            self._has_begun, self._started_ns, self._started_t = True, woken, now
        # Taken next to `now`: each recorded tick pairs the two clocks.
        self._row["monotonic"] = 1e-9 * time.monotonic_ns()
        decision = self._step.take(state, now, self)
        answer, command = self._answer, decision.command
        self.rig.write(command)
        self._safe_state = decision.safe_state
        self._look_for_stops(period, now, decision.stop)
        self._record(period, now, state, command.tau, answer, woken)
        if answer is not None:
            self._look_for_drift(now, answer)
        # Control must answer before the latch is reset: a missing control cannot carry the arm.
        if self._was_stopped and self._resets and not self.hearing.is_asked_to_end and answer is not None:
            self.hearing.reset(now, "The virtual operator has reset the latch.")
        mode = self._known_modes[self._mode] if self._mode >= 0 else None
        self.hearing.listen(period, now, mode, is_answered=answer is not None)
        if self._ends_stopped and not self.hearing.is_asked_to_end and period + 1 >= self._job.periods:
            self._is_time_over = True  # a worn machine is let down before its drives are switched off
            self.hearing.hear(ENDS, now)
        is_over = self.hearing.is_asked_to_end or (self._was_stopped and self._ends_stopped)
        return is_over and self._guard.envelope.descent_is_over

    def answer(self, believed: JointState | None, now: float) -> ControlRequest | None:
        """Return the answer of the control process, if it comes in time."""
        answer = self._answer = None if believed is None else self._asked(believed, now, self._woken)
        if answer is None:
            self.closure_slope = 0.0
            return None
        self.closure_slope = answer["slope"]
        self._enter(int(answer["mode"]), now)
        return ControlRequest(int(answer["sequence"]), float(answer["valid_until"]), answer["tau"])

    def report(self, timing: Timing, rights: Rights) -> GuardReport:
        """Return the report at the end of the loop."""
        latches, modes = tuple(self._latches), tuple(self._modes)
        return GuardReport(timing, rights, latches, self._unanswered, self.rig.t, self._started_ns, modes, self.failure)

    def close(self) -> None:
        """Release the shared memory."""
        for memory in (self._states, self._answers, self._ticks, self._events, self._guard_states, self._inbox):
            memory.close()

    def _woke(self, period: int) -> int:
        """Return the start of this tick [ns], and note how late it is."""
        woken, period_ns = time.monotonic_ns(), self._job.period_ns
        before, self._woken = self._woken or woken - period_ns, woken
        begun = self._started_ns or woken - period * period_ns  # the first tick is on time
        # The deadlines of a machine that waits move with each late tick.
        due = before + period_ns if self._is_awaited else begun + period * period_ns
        self._row["lateness_us"] = 1e-3 * max(woken - due, 0)
        return woken

    def _asked(self, believed: JointState, now: float, woken: int) -> np.void | None:
        """Send the believed state to control, and wait for the answer until the deadline."""
        state = self._state
        state["sequence"], state["now"], state["safe_state"] = believed.sequence, now, self._safe_state
        state["q"], state["current"] = believed.q, believed.current
        self.hearing.tell(state)
        person = self._guard.envelope.person
        state["gravity_level"] = 0.0 if person is None else person.gravity_level
        self._states.write(state)
        is_given_up = self._silent >= GIVEN_UP_AFTER
        waits = not is_given_up or believed.sequence % ASKED_AGAIN_EVERY == 0
        until = woken + (self._given_up_by_ns if is_given_up else self._answer_by_ns) * waits
        while True:
            got = self._answers.read()
            if got is not None and int(got[1]["sequence"]) == believed.sequence:
                if not 0 <= int(got[1]["mode"]) < len(self._job.mode_names):
                    break  # An answer with a mode that does not exist is no answer.
                self._silent = 0
                self.hearing.delivered()
                return got[1]
            if time.monotonic_ns() >= until:
                break
            time.sleep(LOOK_S)
        self._unanswered += 1
        self._silent += 1
        return None

    def _enter(self, mode: int, now: float) -> None:
        if mode != self._mode:
            self._mode, self._phase, name = mode, self._phase + 1, self._job.mode_names[mode]
            self._modes.append((name, self._passed_s(now)))
            self._events.put(event(now, PHASE, name))
            self._announce(name)
            if text := self._job.notes.get(name):
                self._note(now, text)

    def _passed_s(self, now: float) -> float:
        """Return the time since the first tick [s], on the clock of drives that wait or of this computer."""
        return now - self._started_t if self._is_awaited else 1e-9 * (time.monotonic_ns() - self._started_ns)

    def _look_for_drift(self, now: float, answer: np.void) -> None:
        """Record a new finding of control's drift monitor, and let the arm down if it has to."""
        before, self._drift_known = self._drift_known, int(answer["drift"])
        if self._drift_known <= before or (finding := DriftFinding.of_answer(answer)) is None:
            return
        self._events.put(event(now, "warning", finding.text(self.rig.joints)))
        if finding.stops:
            self._guard.envelope.trip(StopReason.DRIFTED)
            self.hearing.acts |= DRIFTED

    def _note(self, now: float, text: str) -> None:
        self._events.put(event(now, "note", text))

    def _look_for_stops(self, period: int, now: float, stop: StopReason | None) -> None:
        """Record each stop once, when it begins."""
        was_stopped = self._was_stopped
        self._was_stopped = stop is not None
        if stop is StopReason.STOP_PRESSED and not was_stopped and self._is_time_over:
            self._note(now, TIME_IS_OVER)
            self.hearing.latched()
        elif stop is not None and not was_stopped:
            self._latches.append(StopLatch(stop.value, period, self._passed_s(now)))
            self._events.put(event(now, "stop", stop.value))
            self.hearing.latched()

    def _record(
        self, period: int, now: float, state: JointState, tau: np.ndarray, answer: np.void | None, woken: int
    ) -> None:
        row = self._row
        row["now"], row["acts"], self.hearing.acts = now, self.hearing.acts, 0
        row["faulty"] = sum(1 << joint for joint in state.faulty)
        row["q_motor"] = np.nan if state.q_motor is None else state.q_motor
        row["t"], row["phase"], row["sequence"] = state.t, self._phase, state.sequence & 0xFFFFFFFF
        row["safe_state"], row["tick_us"] = self._safe_state + 1, 1e-3 * (time.monotonic_ns() - woken)
        row["q_measured"], row["current"] = state.q, state.current
        row["tau_measured"], row["tau_commanded"] = self._gain * state.current, tau
        if answer is None:
            for name in UNANSWERED:
                row[name] = np.nan
            row["seen"] = 0
        else:
            for name in ("drive", "gravity_level", "arm_share"):
                row[name] = answer[name]
            row["seen"], row["control"] = answer["seen"] & 0xFFFFFFFF, answer["findings"]
            row["v"], row["q_reference"], row["tau_desired"] = answer["v"], answer["q_reference"], answer["tau"]
            row["tau_feedforward"], row["closure_slope"] = answer["tau_feedforward"], answer["slope"]
        self._ticks.put(row)
        self._guard_states.keep(now, state.t, self.hearing.persons)
