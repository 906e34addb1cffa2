"""The loop of a session: read, observe, decide, limit, command, record; the same for every phase and controller."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import RigError
from exograv.model.loops import NEAR_SINGULAR
from exograv.motion import Trajectory
from exograv.recording import RecordingWriter
from exograv.rig import Powered, Rig, may_be_worn
from exograv.runtime.clock.pace import RealTimePace
from exograv.runtime.control_loop.exchange import ASTRAY
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.signals import JointState, Reference
from exograv.storage.self_test_pass import MachineKey, unlock, withdraw_pass

from .arm_controller import ArmController
from .control_step import ControlStep
from .interrupt import HeldInterrupt
from .output_feedback import Controller, Guide, OutputFeedback
from .person_limits_manager import PersonLimitsManager
from .phases import Phase
from .replay_log import ReplayLog, mode_fields
from .stop_message import stopped_text

Joints = Float[np.ndarray, " joint"]
Progress = Callable[[str, float], None]
"""Called with a sentence and the share done, now and then."""

PROGRESS_TICKS = 200
NEAR_SINGULAR_TEXT = (
    "The arm is near a posture in which its angles mean little (abduction near 90°); it is carried, not learned from."
)
GAIN_SD_KNOWN = 0.05  # share: so well calibrated, a motor's current tells its torque to the guard


@dataclass
class TickSample:
    """One tick, for whoever listens; arrays are overwritten by the next."""

    state: JointState
    q: Joints
    """Observed [rad]."""
    v: Joints
    """[rad/s]"""
    tau_measured: Joints
    """By current and gain [N·m]."""
    tau_commanded: Joints
    """[N·m]"""
    tau_feedforward: Joints
    """[N·m]"""
    reference: Reference
    """What was asked for."""


@dataclass
class Pilot:
    """Owns what lives across the phases of a run on one rig."""

    rig: Rig
    actuators: ActuatorGain
    envelope: Envelope
    recording: RecordingWriter | None = None
    progress: Progress = lambda _text, _share: None
    pace: RealTimePace | None = None
    worn: PersonLimitsManager | None = None
    """Tells the guard who is in the machine; nobody is if absent."""
    key: MachineKey | None = None
    """What unlocks a real machine for an arm."""
    tick_us: list[float] = field(default_factory=list)
    """Time that each decision took, guard included [µs]."""

    def __post_init__(self):
        joints, period_s = len(self.rig.joints), self.rig.period_s
        self.feedback = OutputFeedback(joints, period_s)
        """Control's half of each tick."""
        self._no_answer = np.full(joints, np.nan)
        # An empty machine that is tried for the first time is held by the envelope alone: what is wrong with encoders
        # and motors the nudge finds and names, and a current says little of a torque yet.
        is_known = bool((self.actuators.gain_sd <= GAIN_SD_KNOWN * np.abs(self.actuators.gain)).all())
        self.guard = Guard.of_machine(self.envelope, period_s, self.actuators.gain.tolist(), is_known)
        self._step = ControlStep(self.guard, self.actuators.gain)
        self._near_singular = False
        self._account = None if self.recording is None else ReplayLog(self.recording, self.actuators, period_s)
        self._stop_known = self.envelope.stop
        self.q = self.rig.read().q.copy()
        """Where the joints were at the last tick [rad]."""

    def begin(self, phase: Phase | str) -> None:
        """Note in the recording what the ticks from here on are for."""
        if self.recording is not None:
            self.recording.phase(self.rig.read().t, phase if isinstance(phase, str) else phase.recorded)

    def run(
        self,
        controller: Controller,
        trajectory: Trajectory,
        text: str,
        listener: Callable[[TickSample], None] | None = None,
        guide: Guide | None = None,
    ) -> None:
        """Follow a trajectory to its end; or, for as long as it lasts, what a `guide` says.

        Raises:
            RigError: The envelope stopped the run, and the arm has come down softly; or it is an arm's controller, and
                the machine is locked.
            KeyboardInterrupt: Ctrl-C; a real machine has come down softly before.
        """
        if isinstance(controller, ArmController):
            unlock(self.rig, self.key)
        if isinstance(self.rig, Powered) and self.envelope.stop is None:
            self._switch_on(self.rig)
        with HeldInterrupt(may_be_worn(self.rig)) as interrupt:
            for k in range(len(trajectory)):
                reference = Reference(trajectory.q[k], trajectory.v[k], trajectory.a[k])
                moment = self._tick(controller, reference, guide)
                if listener is not None and moment is not None:
                    listener(moment)
                if interrupt.has_come:
                    self.guard.press_stop()
                if self.envelope.stop is not None:
                    self._come_down(controller, reference, interrupt.has_come)
                if k % PROGRESS_TICKS == 0:
                    self.progress(text, k / len(trajectory))
        self.progress(text, 1.0)

    def _switch_on(self, rig: Powered) -> None:
        """Drives that are off, because nobody has flown them yet or because they heard nothing for a while."""
        if not all(drive.is_enabled for drive in rig.status()):
            rig.enable()

    def leave_stop(self, controller: Controller, within_s: float) -> bool:
        """An operator's act after a stop: wait until the machine stands, and leave the latch; whether it could be."""
        still = np.zeros(len(self.q))
        for _ in range(round(within_s / self.rig.period_s)):
            if self.guard.reset():
                return True
            self._tick(controller, Reference(self.q, still, still))
        return False

    def _tick(self, controller: Controller, reference: Reference, guide: Guide | None = None) -> TickSample | None:
        """One tick; None where nothing was measured that may be believed: nobody is to learn from it."""
        state, now = self.rig.read(), self.rig.t
        if self._account is not None:
            self._account.note(state.t, controller, self.envelope.person)
        # Whoever watches a motion may have tripped the envelope between two ticks.
        acts = ASTRAY if self.envelope.stop is not self._stop_known else 0
        feedback = self.feedback
        feedback.controller, feedback.reference, feedback.guide = controller, reference, guide
        start = time.perf_counter_ns()
        decision = self._step.take(state, now, feedback)
        tick_us = 1e-3 * (time.perf_counter_ns() - start)
        believed, submitted, command = decision.believed, decision.submitted, decision.command
        self.rig.write(command)
        self.tick_us.append(tick_us)
        if believed is not None:
            self.q = believed.q
        reference, v = feedback.reference, feedback.v
        self._stop_known = self.envelope.stop
        self._watch_posture(controller.clearance, state.t)
        tau_measured = self.actuators.torque(state.current)
        if self.recording is not None:
            self.recording.tick(
                state.t,
                now=now,
                **mode_fields(controller),
                control=self.recording.count("/control"),
                faulty=sum(1 << joint for joint in state.faulty),
                acts=acts,
                closure_slope=decision.closure_slope,
                tick_us=tick_us,
                safe_state=decision.safe_state + 1,
                sequence=state.sequence,
                q_measured=state.q,
                q_reference=reference.q,
                v_reference=reference.v,
                a_reference=reference.a,
                q_motor=np.nan if state.q_motor is None else state.q_motor,
                v=v,
                current=state.current,
                tau_measured=tau_measured,
                tau_feedforward=controller.tau_feedforward,
                tau_desired=self._no_answer if submitted is None else submitted.tau,
                tau_commanded=command.tau,
            )
        if self.pace is not None:
            self.pace.wait()
        if believed is None:
            return None
        return TickSample(believed, feedback.q, v, tau_measured, command.tau, controller.tau_feedforward, reference)

    def _watch_posture(self, clearance: float, t: float) -> None:
        """Note when the arm comes near a singular posture, once each time."""
        is_near = clearance < NEAR_SINGULAR
        if is_near and not self._near_singular and self.recording is not None:
            self.recording.write("/event", t, {"kind": "near singular", "text": NEAR_SINGULAR_TEXT})
        self._near_singular = is_near

    def _come_down(self, controller: Controller, reference: Reference, is_interrupted: bool) -> None:
        """Finish the soft descent, then tell."""
        reason, recording = self.envelope.stop, self.recording
        text = reason.value if reason is not None else ""
        if recording is not None:
            recording.write("/event", self.rig.read().t, {"kind": "stop", "text": text})
        path = None if recording is None else recording.path
        told = stopped_text(self.envelope, self.rig.joints, path)
        try:
            for _ in range(round((self.envelope.limits.descent_s + 1.0) / self.rig.period_s)):
                self._tick(controller, reference)
        finally:
            if self.key is not None:
                withdraw_pass(self.key.file, text)
        if is_interrupted:
            raise KeyboardInterrupt
        raise RigError(told)
