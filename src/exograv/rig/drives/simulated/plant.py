"""A twin's motors behind simulated drives, and how somebody has wired them, rightly or not."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np

from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import Drives
from exograv.rig.interface import Rig
from exograv.safety.guard import COMMAND_LIFE_S
from exograv.signals import Command, JointState

from .firmware import Output, SimulatedDrive


@runtime_checkable
class SimulatedMachine(Rig, Protocol):
    """A machine whose motors and people are computed, such as the twin."""

    tau_hand: np.ndarray
    """Torque that a hand exerts on the machine's joints (joint,) [N·m]."""

    tau_voluntary: np.ndarray
    """Torque of the wearer's muscles on the own joints (freedom,) [N·m]."""

    def drive_damping(self) -> np.ndarray:
        """Damping by which the drives brake (joint,) [N·m·s/rad]."""
        ...

    def turn_motor(self, joint: int, factor: float) -> None:
        """Let a motor give so many times the torque for its current."""
        ...

    def hang(self, mount: str, mass_kg: float) -> None:
        """Hang a known weight on a mount [kg]."""
        ...


@dataclass(frozen=True)
class Wiring:
    """How one joint is connected, beside what `drives.toml` says of it."""

    current: float = 1.0
    """Factor of the motor's torque: -1 is a motor with two leads exchanged, 0.5 a wrong torque constant."""

    encoder: float = 1.0
    """Factor of what the encoder says; -1 is one that counts the other way."""


class Plant:
    """Steps the twin; each drive reads its own encoders and current, in its own units and directions.

    `now` is the twin's clock: a real-time bus steps it by the wall clock, a lock-step one with each measurement.
    """

    def __init__(self, twin: SimulatedMachine, drives: Drives, wiring: Mapping[str, Wiring] | None = None):
        """All drives are off; the twin stands as it was made."""
        self.twin = twin
        self.each = tuple(SimulatedDrive(one, drives.watchdog_s) for one in drives.each)
        """In the order of the machine's joints."""
        self.outputs = tuple(Output(0.0, one.brake_Nms_per_rad) for one in drives.each)
        """What each drive did in the last step."""
        joints = [(wiring or {}).get(joint, Wiring()) for joint in drives.joints]
        self._of_current = drives.sign * [joint.current for joint in joints]
        self._of_encoder = drives.sign * [joint.encoder for joint in joints]
        self._wired, self._brakes = self._of_current, np.ones(len(joints))
        self._offset = drives.offset
        self.before_step: Callable[[], object] = lambda: None
        """What somebody in the machine does, of the own accord, before each step."""
        self._measured = twin.read()
        self._sequence, self._ahead_s = 0, 0.0
        self.watch: Callable[[], object] | None = None
        """For examiners: called after each step."""

    @property
    def now(self) -> float:
        """The drives' clock: the twin's, which was there at first [s]."""
        return self._ahead_s + self.twin.t

    def change(self, twin: SimulatedMachine) -> None:
        """Another twin behind the same drives, whose clock goes on, and whose motors are as they were wired."""
        self._ahead_s += self.twin.t - twin.t
        self.twin, self._measured = twin, twin.read()
        self._of_current, self._brakes = self._wired, np.ones_like(self._brakes)

    def turn_motor(self, joint: int, factor: float) -> None:
        """A motor gives so many times the torque for its current, and the opposite where that is negative.

        With its phases shorted it brakes by the square of that; stronger it is not counted on.
        """
        self._of_current, self._brakes = self._of_current.copy(), self._brakes.copy()
        self._of_current[joint] *= factor
        self._brakes[joint] = min(self._brakes[joint] * factor**2, 1.0)
        self.twin.turn_motor(joint, factor)

    def step(self) -> None:
        """One period of the twin: what the drives do now holds for all of it."""
        twin, now = self.twin, self.twin.t
        self.before_step()
        self.outputs = outputs = tuple(drive.step(twin.period_s, self.now) for drive in self.each)
        current = self._of_current * [output.current for output in outputs]
        damping = self._brakes * [output.damping for output in outputs]
        self._sequence += 1
        # A command lives for longer than a step and a dead time: the twin's own watchdog stays out of it.
        twin.write(Command(now, self._sequence, now + COMMAND_LIFE_S, np.zeros_like(current), current, damping))
        self._measured = twin.read()
        if self.watch is not None:
            self.watch()

    @property
    def measured(self) -> JointState:
        """What the twin's sensors say, in the joints' own directions; for examiners."""
        return self._measured

    def position(self, joint: int) -> float:
        """What the drive's encoder at the joint says [rad], in the drive's direction and from its own zero."""
        return float((self._measured.q[joint] - self._offset[joint]) * self._of_encoder[joint])

    def motor_position(self, joint: int) -> float:
        """The same of the encoder on the motor's shaft; as the other where there is none."""
        q_motor = self._measured.q_motor
        if q_motor is None:
            return self.position(joint)
        return float((q_motor[joint] - self._offset[joint]) * self._of_encoder[joint])

    def current(self, joint: int) -> float:
        """What the drive measures in its motor [A], in its own direction, whatever torque comes of it."""
        return float(self._measured.current[joint] / self._of_current[joint])

    def press_stop(self) -> None:
        """The hardware stop: every drive is off and brakes."""
        for drive in self.each:
            drive.fail(DriveFault.STOP_LINE)

    def release_stop(self) -> None:
        """Its line is closed again; nothing moves before somebody enables."""
        for drive in self.each:
            drive.fault &= ~DriveFault.STOP_LINE
