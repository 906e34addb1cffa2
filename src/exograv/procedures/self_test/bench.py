"""The empty machine on the bench: what all moving steps of the self-test share."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.control.exo_tick import most_damping
from exograv.errors import IdentificationError, RigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot, Progress, TickSample
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.motion import Trajectory, go_to, hold
from exograv.procedures.calibration.empty_run import EmptyRun
from exograv.rig import Rig
from exograv.rig.drives.opening import DrivenRig
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.envelope import Envelope, StopReason
from exograv.safety.guard import Guard

from .recording_rig import PoweredRecordingRig, RecordedTicks, RecordingRig

TRAVEL = 1.1  # rad/s between postures

REST_WITHIN_S = 5.0  # after a descent: a light machine sinks slowly, braked

Joints = Float[np.ndarray, " joint"]
Press = Callable[[Guard], None]
"""Presses Stop: on the twin by itself; on hardware an operator is asked to, and the button's line tells the guard."""


def press_software_stop(guard: Guard) -> None:
    """As Ctrl-C, or a button on a screen; the hardware stop of drives has a step of its own."""
    guard.press_stop()


@dataclass(frozen=True)
class TestedMachine:
    """What is tested."""

    description: RigDescription
    tree: Tree
    """Set to the lengths of the calibration."""

    calibration: Calibration
    rig: Rig
    """Empty, hanging, and just switched on."""

    press: Press

    brake: Joints | None = None
    """With which its drives are set to brake by themselves; that of a soft descent where absent [N·m·s/rad]."""

    in_lock_step: bool = True
    """Whether the machine waits for us: a real one does not."""


class SelfTestRun:
    """One self-test under way."""

    def __init__(self, subject: TestedMachine, progress: Progress):
        """Look at the machine; nothing moves."""
        machine = subject.calibration.machine
        self.description, self.calibration, self.press = subject.description, subject.calibration, subject.press
        self.tree = replace(subject.tree, phi=machine.phi)
        self.gain = machine.actuators.gain
        self.tap = PoweredRecordingRig(subject.rig) if isinstance(subject.rig, DrivenRig) else RecordingRig(subject.rig)
        worn = limits(subject.description)
        self.drive_damping = worn.damping_Nms_per_rad if subject.brake is None else subject.brake
        """With which a drive has to brake that hears nothing (joint,) [N·m·s/rad]."""
        # Without an arm in it a light machine shakes under the damping that suits a worn one.
        self.damping = np.minimum(worn.damping_Nms_per_rad, most_damping(self.description, self.tree))
        """Of a soft descent of the empty machine (joint,) [N·m·s/rad]."""
        envelope = Envelope(replace(worn, damping_Nms_per_rad=self.damping), subject.rig.period_s)
        pace = None if subject.in_lock_step else RealTimePace(subject.rig.period_s)
        self.pilot = Pilot(self.tap, machine.actuators, envelope, progress=progress, pace=pace)
        self.run = EmptyRun(self.description, self.tree, self.pilot, gravity=machine.gravity)
        self.zero = np.zeros(len(self.description.joints))
        """Torque that the motors report while they are told none (joint,) [N·m]."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Of the machine."""
        return self.description.joints

    def tau(self, passed: RecordedTicks) -> Float[np.ndarray, "tick joint"]:
        """Measured torque [N·m]."""
        return self.gain * passed.current - self.zero

    def fly(self, controller: Controller, seconds: float, text: str) -> RecordedTicks:
        """Let a controller work; what passed meanwhile."""
        start = self.tap.ticks
        path = hold(self.pilot.q.copy(), seconds, self.tap.period_s)
        self.pilot.run(controller, path, text, self.run.listen)
        return self.tap.passed(start)

    def go(self, q: Joints, text: str) -> None:
        """Lead the machine to a posture [rad]."""
        self.run.follow(go_to(self.pilot.q.copy(), q, TRAVEL, self.tap.period_s), text)

    def come_down(
        self, controller: Controller, path: Trajectory, text: str, listener: Callable[[TickSample], None]
    ) -> StopReason | None:
        """Fly until the guard stops it, come down, and leave the latch; why it stopped, None where it did not.

        Raises:
            RigError: The latch cannot be left.
        """
        try:
            self.pilot.run(controller, path, text, listener)
        except RigError:
            reason = self.pilot.envelope.stop
            self.tap.is_silent = False
            if not self.pilot.leave_stop(controller, REST_WITHIN_S):
                raise RigError(
                    "After a stop the machine does not come to rest, or does not say where it is. Look at encoders "
                    "and drives, then repeat the self-test."
                ) from None
            return reason
        finally:
            self.tap.is_silent = False
        return None

    def leave(self) -> None:
        """Whatever was going on: let the machine down softly, if it still listens."""
        try:
            if self.pilot.envelope.stop is None:
                self.pilot.guard.press_stop()
                self.fly(self.run.controller, 0.01, "Coming down")
        except (RigError, IdentificationError):
            pass  # it has come down, or does not listen: its drives brake
