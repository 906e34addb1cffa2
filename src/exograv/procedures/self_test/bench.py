"""Empty machine on the bench: shared setup of all moving steps of the self-test."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.control.exo_tick import most_damping
from exograv.errors import IdentificationError, RigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.loop.machine_limits import limits
from exograv.loop.output_feedback import Controller
from exograv.loop.pilot import Pilot, Progress
from exograv.loop.tick_sample import TickSample
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.motion import Trajectory, go_to, hold
from exograv.procedures.calibration.empty_run import EmptyRun
from exograv.rig import Rig
from exograv.rig.drives.opening import DrivenRig
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard
from exograv.safety.stops import StopReason

from .recording_rig import PoweredRecordingRig, RecordedTicks, RecordingRig

TRAVEL = 1.1  # rad/s between postures

REST_WITHIN_S = 5.0  # after a descent, since a light machine sinks slowly while it brakes

Joints = Float[np.ndarray, " joint"]
Press = Callable[[Guard], None]
"""Callback that triggers Stop. On the twin it acts directly. On hardware the operator is asked to press the button,
whose line reports to the guard."""


def press_software_stop(guard: Guard) -> None:
    """Press Stop in software, like Ctrl-C or a button on a screen. The drives' hardware stop has its own step."""
    guard.press_stop()


@dataclass(frozen=True)
class TestedMachine:
    """Machine under test: its model, its calibration, and the rig that moves it."""

    description: RigDescription
    tree: Tree
    """Kinematic tree, set to the lengths of the calibration."""

    calibration: Calibration
    rig: Rig
    """Rig of the machine: empty, hanging, and just switched on."""

    press: Press

    brake: Joints | None = None
    """Damping with which the drives brake by themselves [N·m·s/rad]; that of a soft descent if None."""

    in_lock_step: bool = True
    """True if the machine waits for the computer; a real machine does not."""


class SelfTestRun:
    """State of one self-test."""

    def __init__(self, subject: TestedMachine, progress: Progress):
        """Prepare the test; nothing moves."""
        machine = subject.calibration.machine
        self.description, self.calibration, self.press = subject.description, subject.calibration, subject.press
        self.tree = replace(subject.tree, phi=machine.phi)
        self.gain = machine.actuators.gain
        self.tap = PoweredRecordingRig(subject.rig) if isinstance(subject.rig, DrivenRig) else RecordingRig(subject.rig)
        worn = limits(subject.description)
        self.drive_damping = worn.damping_Nms_per_rad if subject.brake is None else subject.brake
        """Damping with which a drive must brake without commands (joint,) [N·m·s/rad]."""
        # Without an arm a light machine shakes under the damping of a worn machine.
        self.damping = np.minimum(worn.damping_Nms_per_rad, most_damping(self.description, self.tree))
        """Damping of a soft descent of the empty machine (joint,) [N·m·s/rad]."""
        envelope = Envelope(replace(worn, damping_Nms_per_rad=self.damping), subject.rig.period_s)
        pace = None if subject.in_lock_step else RealTimePace(subject.rig.period_s)
        self.pilot = Pilot(self.tap, machine.actuators, envelope, progress=progress, pace=pace)
        self.run = EmptyRun(self.description, self.tree, self.pilot, gravity=machine.gravity)
        self.zero = np.zeros(len(self.description.joints))
        """Torque that the motors report at zero command (joint,) [N·m]."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints of the machine."""
        return self.description.joints

    def tau(self, passed: RecordedTicks) -> Float[np.ndarray, "tick joint"]:
        """Measured torque, less the torque that the motors report at zero command [N·m]."""
        return self.gain * passed.current - self.zero

    def fly(self, controller: Controller, seconds: float, text: str) -> RecordedTicks:
        """Run a controller for `seconds`, and return the recorded ticks."""
        start = self.tap.ticks
        path = hold(self.pilot.q.copy(), seconds, self.tap.period_s)
        self.pilot.run(controller, path, text, self.run.listen)
        return self.tap.passed(start)

    def go(self, q: Joints, text: str) -> None:
        """Move the machine to a posture [rad]."""
        self.run.follow(go_to(self.pilot.q.copy(), q, TRAVEL, self.tap.period_s), text)

    def come_down(
        self, controller: Controller, path: Trajectory, text: str, listener: Callable[[TickSample], None]
    ) -> StopReason | None:
        """Run until the guard stops, come down and leave the latch.

        Return the reason of the stop; None if the guard did not stop.

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
                    "After a stop the machine does not come to rest, or its encoders do not answer. Check encoders "
                    "and drives, then repeat the self-test."
                ) from None
            return reason
        finally:
            self.tap.is_silent = False
        return None

    def leave(self) -> None:
        """Let the machine down softly at the end of any run, if it still reacts."""
        try:
            if self.pilot.envelope.stop is None:
                self.pilot.guard.press_stop()
                self.fly(self.run.controller, 0.01, "Coming down")
        except (RigError, IdentificationError):
            pass  # the machine has come down, or does not react and its drives brake
