"""Loop of a session: read, observe, decide, limit, command, record. The same for every phase and controller."""

import math
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import RigError
from exograv.model.loops import NEAR_SINGULAR
from exograv.motion import Trajectory
from exograv.recording import RecordingWriter, TickRow
from exograv.rig import Powered, Rig, may_be_worn
from exograv.runtime.clock.pace import RealTimePace
from exograv.runtime.control_loop.exchange import ASTRAY, DRIFTED
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.safety.stops import StopReason
from exograv.signals import JointState, Reference
from exograv.storage.self_test_pass import MachineKey, unlock, withdraw_pass

from .arm_controller import ArmController
from .bridged_listener import BridgedListener
from .control_step import ControlStep, Decision
from .drift_monitor import DriftMonitor
from .interrupt import HeldInterrupt
from .native_ticks import NativeTicks
from .output_feedback import Controller, Guide, OutputFeedback
from .person_limits_manager import PersonLimitsManager
from .phases import Phase
from .replay_log import ReplayLog, mode_values
from .stop_message import stopped_text
from .tick_sample import TickSample

Joints = Float[np.ndarray, " joint"]
Progress = Callable[[str, float], None]
"""Callback with a sentence and the finished share [-], called from time to time."""

PROGRESS_TICKS = 200
NATIVE_FROM = 3
"""Number of ticks in which native code may take over: a controller's first ticks start from cold in Python."""
NEAR_SINGULAR_TEXT = (
    "The arm is near a posture in which its angles are ill-defined (abduction near 90°). It is carried, not identified."
)
GAIN_SD_KNOWN = 0.05  # [-] Up to this relative SD of the gain, the guard may infer a motor's torque from its current.


@dataclass
class Pilot:
    """Owner of all objects that live across the phases of a run on one rig."""

    rig: Rig
    actuators: ActuatorGain
    envelope: Envelope
    recording: RecordingWriter | None = None
    progress: Progress = lambda _text, _share: None
    pace: RealTimePace | None = None
    worn: PersonLimitsManager | None = None
    """Setter of the wearer's limits in the guard; absent if the machine is not worn."""
    key: MachineKey | None = None
    """Machine and passed self-test that a real machine needs before it carries an arm; None otherwise."""
    drift: DriftMonitor | None = None
    """Monitor of the arm that its controller carries; None while the arm is not known."""
    tick_us: Counter[float] = field(default_factory=Counter)
    """Number of ticks by the computing time of their decision, guard included, to 0.1 µs [µs]."""

    def __post_init__(self):
        joints, period_s = len(self.rig.joints), self.rig.period_s
        self.feedback = OutputFeedback(joints, period_s)
        """Control's half of each tick."""
        self._unknown = np.full(joints, np.nan)
        """Value of an array that a tick does not have."""
        # The envelope alone holds an empty machine on its first trial. The nudge test finds faults of encoders and
        # motors, and before the calibration a current says little about a torque.
        is_known = bool((self.actuators.gain_sd <= GAIN_SD_KNOWN * np.abs(self.actuators.gain)).all())
        self.guard = Guard.of_machine(self.envelope, period_s, self.actuators.gain.tolist(), is_known)
        self._step = ControlStep(self.guard, self.actuators.gain)
        self._native = NativeTicks.of(self.rig, self.guard, self.actuators.gain)
        """The same ticks in native code; None if a part has none."""
        self._near_singular = False
        self._account = None if self.recording is None else ReplayLog(self.recording, self.actuators, period_s)
        self._stop_known = self.envelope.stop
        self.q = self.rig.read().q.copy()
        """Joint position at the last tick [rad]."""

    def begin(self, phase: Phase | str) -> None:
        """Note in the recording the phase of the ticks that follow."""
        if self.recording is not None:
            self.recording.phase(self.rig.t, phase if isinstance(phase, str) else phase.recorded)

    def run(
        self,
        controller: Controller,
        trajectory: Trajectory,
        text: str,
        listener: Callable[[TickSample], None] | None = None,
        guide: Guide | None = None,
    ) -> None:
        """Follow a trajectory to its end, or follow a `guide` for the duration of the trajectory.

        Raises:
            RigError: The envelope stopped the run, and the arm has come down softly. Or the controller carries an arm
                and the machine is locked.
            KeyboardInterrupt: Ctrl-C was pressed. A real machine has come down softly before.
        """
        if isinstance(controller, ArmController):
            unlock(self.rig, self.key)
        if isinstance(self.rig, Powered) and self.envelope.stop is None:
            self._switch_on(self.rig)
        native, is_bound = self._native if guide is None else None, False
        bridged = BridgedListener(listener)
        with HeldInterrupt(may_be_worn(self.rig)) as interrupt:
            for k, values in enumerate(zip(trajectory.q, trajectory.v, trajectory.a, strict=True)):
                reference = Reference(*values)
                if native is not None and not is_bound and k < NATIVE_FROM:
                    is_bound = native.begin(self.feedback, controller, trajectory)
                if native is not None and is_bound and native.may_run:
                    moment = self._native_tick(native, controller, reference, k)
                    bridged.pass_on(moment)
                else:
                    moment = self._tick(controller, reference, guide)
                    bridged.take(moment)
                self._look_for_drift(controller, moment)
                if interrupt.has_come:
                    self.guard.press_stop()
                if self.envelope.stop is not None:
                    self._come_down(controller, reference, interrupt.has_come)
                if k % PROGRESS_TICKS == 0:
                    self.progress(text, k / len(trajectory))
        self.progress(text, 1.0)

    def _switch_on(self, rig: Powered) -> None:
        """Enable the drives if any is off: before the first run, or after a time-out without commands."""
        if not all(drive.is_enabled for drive in rig.status()):
            rig.enable()

    def leave_stop(self, controller: Controller, within_s: float) -> bool:
        """Wait until the machine stands still, and reset the stop.

        True if this succeeded. Only an operator may request it.
        """
        still = np.zeros(len(self.q))
        for _ in range(round(within_s / self.rig.period_s)):
            if self.guard.reset():
                return True
            self._tick(controller, Reference(self.q, still, still))
        return False

    def _tick(self, controller: Controller, reference: Reference, guide: Guide | None = None) -> TickSample | None:
        """Run one tick. Return None if no trustworthy measurement arrived, so that no listener learns from it."""
        state, now = self.rig.read(), self.rig.t
        if self._account is not None:
            self._account.note(state.t, controller, self.envelope.person)
        # A listener may have tripped the envelope between two ticks.
        acts = self._acts_since_tick()
        feedback = self.feedback
        feedback.controller, feedback.reference, feedback.guide = controller, reference, guide
        start = time.perf_counter_ns()
        decision = self._step.take(state, now, feedback)
        tick_us = 1e-3 * (time.perf_counter_ns() - start)
        believed, command = decision.believed, decision.command
        self.rig.write(command)
        self.tick_us[round(tick_us, 1)] += 1
        if believed is not None:
            self.q = believed.q
        self._stop_known = self.envelope.stop
        self._watch_posture(controller.clearance, state.t)
        tau_measured = self.actuators.torque(state.current)
        if self.recording is not None:
            self._record(self.recording, state, now, acts, tick_us, decision, tau_measured)
        if self._account is not None:
            self._account.keep_guard(state.t, now, self.envelope.record)
        if self.pace is not None:
            self.pace.wait()
        if believed is None:
            return None
        feedforward = controller.tau_feedforward
        return TickSample(
            believed, feedback.q, feedback.v, tau_measured, decision.command.tau, feedforward, feedback.reference
        )

    def _native_tick(
        self, native: NativeTicks, controller: Controller, reference: Reference, k: int
    ) -> TickSample | None:
        """Run one tick as `_tick`, in native code."""
        t, recording = self.rig.t, self.recording
        if self._account is not None:
            self._account.note(t, controller, self.envelope.person)
        acts = self._acts_since_tick()
        believed = native.run(k, reference, acts, recording)
        self._step.check_model(controller.closure_slope)
        self.tick_us[round(native.tick_us, 1)] += 1
        self._stop_known = self.envelope.stop
        self._watch_posture(controller.clearance, t)
        if self._account is not None:
            self._account.keep_guard(t, t, self.envelope.record)
        if self.pace is not None:
            self.pace.wait()
        if believed is None:
            return None
        self.q, feedback = believed.q, self.feedback
        return TickSample(
            believed,
            feedback.q,
            feedback.v,
            native.tau_measured,
            native.tau_commanded,
            controller.tau_feedforward,
            reference,
        )

    def _record(
        self,
        recording: RecordingWriter,
        state: JointState,
        now: float,
        acts: int,
        tick_us: float,
        decision: Decision,
        tau_measured: Joints,
    ) -> None:
        """Record a tick, in the order of the table of `/tick`."""
        feedback = self.feedback
        controller, reference, submitted = feedback.controller, feedback.reference, decision.submitted
        recording.tick_row(
            TickRow(
                state.t,
                now,
                math.nan,
                *mode_values(controller),
                decision.closure_slope,
                tick_us,
                math.nan,
                decision.safe_state + 1,
                state.sequence,
                recording.count("/control"),
                0.0,
                sum(1 << joint for joint in state.faulty) if state.faulty else 0.0,
                acts,
                state.q,
                *reference,
                self._unknown if state.q_motor is None else state.q_motor,
                feedback.v,
                state.current,
                tau_measured,
                controller.tau_feedforward,
                self._unknown if submitted is None else submitted.tau,
                decision.command.tau,
            )
        )

    def _acts_since_tick(self) -> int:
        """Return the act of a listener or the drift monitor since the last tick, for the recording."""
        if self.envelope.stop is self._stop_known:
            return 0
        return DRIFTED if self.envelope.stop is StopReason.DRIFTED else ASTRAY

    def _look_for_drift(self, controller: Controller, moment: TickSample | None) -> None:
        """Tell the operator about a new finding of the drift monitor, and let the arm down if it has to."""
        drift = self.drift
        if drift is None or moment is None or drift.controller is not controller or self.envelope.stop is not None:
            return
        finding = drift.take(moment.state.q, moment.tau_measured)
        if finding is None:
            return
        text = finding.text(self.rig.joints)
        if self.recording is not None:
            self.recording.write("/event", moment.state.t, {"kind": "warning", "text": text})
        self.progress(text, 1.0)
        if finding.stops:
            self.envelope.trip(StopReason.DRIFTED)

    def _watch_posture(self, clearance: float, t: float) -> None:
        """Record an event each time the arm comes near a singular posture."""
        is_near = clearance < NEAR_SINGULAR
        if is_near and not self._near_singular and self.recording is not None:
            self.recording.write("/event", t, {"kind": "near singular", "text": NEAR_SINGULAR_TEXT})
        self._near_singular = is_near

    def _come_down(self, controller: Controller, reference: Reference, is_interrupted: bool) -> None:
        """Finish the soft descent, then raise the error."""
        reason, recording = self.envelope.stop, self.recording
        text = reason.value if reason is not None else ""
        if recording is not None:
            recording.write("/event", self.rig.t, {"kind": "stop", "text": text})
        path = None if recording is None else recording.path
        finding = None if self.drift is None else self.drift.finding
        told = stopped_text(self.envelope, self.rig.joints, path, finding)
        try:
            for _ in range(round((self.envelope.limits.descent_s + 1.0) / self.rig.period_s)):
                self._tick(controller, reference)
        finally:
            if self.key is not None:
                withdraw_pass(self.key.file, text)
        if is_interrupted:
            raise KeyboardInterrupt
        raise RigError(told)
