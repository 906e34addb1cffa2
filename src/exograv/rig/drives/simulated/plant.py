"""Motors of a twin behind simulated drives, with right or wrong wiring."""

from collections.abc import Callable, Mapping, Sequence
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
    """Machine whose motors and wearer are simulated, such as the twin."""

    tau_hand: np.ndarray
    """Torque of a hand on the machine's joints (joint,) [N·m]."""

    tau_voluntary: np.ndarray
    """Torque of the wearer's muscles on the wearer's joints (freedom,) [N·m]."""

    def drive_damping(self) -> np.ndarray:
        """Damping of the drives' brakes (joint,) [N·m·s/rad]."""
        ...

    def turn_motor(self, joint: int, factor: float) -> None:
        """Multiply a motor's torque per current by `factor`."""
        ...

    def warm_gain(self, celsius: Sequence[float]) -> np.ndarray | None:
        """Return the factors of the motors' torques per current at these temperatures of the windings [°C].

        None if the temperatures change no gain.
        """
        ...

    def hang(self, mount: str, mass_kg: float) -> None:
        """Hang a known weight on a mount [kg]."""
        ...


@runtime_checkable
class InstructedWearer(Protocol):
    """Simulated person in the machine who follows instructions of an operator."""

    def rest(self, seconds: float, gravity_level: float) -> None:
        """Go to rest within a time [s], while the felt gravity level changes to this value."""
        ...

    def attempt(self) -> None:
        """Get ready for the next attempt."""
        ...

    def reach(self, target: int, place: np.ndarray) -> None:
        """Reach for a target, by its number and its place in the base frame [m]."""
        ...


@dataclass(frozen=True)
class Wiring:
    """Wiring of one joint, in addition to the entries of `drives.toml`."""

    current: float = 1.0
    """Factor of the motor's torque: -1 is a motor with two leads exchanged, 0.5 a wrong torque constant."""

    encoder: float = 1.0
    """Factor of the encoder's value; -1 is an encoder that counts in the other direction."""


class Plant:
    """Twin and drives, stepped together; each drive reads its own encoders and current in its own units and signs.

    `now` is the twin's clock. A real-time bus steps it by the wall clock, a lock-step bus with each measurement.
    """

    def __init__(self, twin: SimulatedMachine, drives: Drives, wiring: Mapping[str, Wiring] | None = None):
        """Start with all drives off and the twin in its initial state."""
        self.twin = twin
        self.each = tuple(SimulatedDrive(one, drives.watchdog_s) for one in drives.each)
        """Simulated drives, in the order of the machine's joints."""
        self.outputs = tuple(Output(0.0, one.brake_Nms_per_rad) for one in drives.each)
        """Output of each drive in the last step."""
        joints = [(wiring or {}).get(joint, Wiring()) for joint in drives.joints]
        self._of_current = drives.sign * [joint.current for joint in joints]
        self._of_encoder = drives.sign * [joint.encoder for joint in joints]
        self._wired, self._brakes = self._of_current, np.ones(len(joints))
        self._warm = np.ones(len(joints))
        """Factors of the torques per current in the last step by the temperatures of the windings."""
        self._offset = drives.offset
        self.before_step: Callable[[], object] = lambda: None
        """Action of a simulated person in the machine, called before each step."""
        self.hear: Callable[[str], None] = lambda _name: None
        """Function that tells a simulated person in the machine the mode that begins, by its name in lower case."""
        self.person: InstructedWearer | None = None
        """Simulated person in the machine who follows instructions; None if there is none."""
        self.therapist: Callable[[str | None], object] | None = None
        """Function with which a simulated therapist begins to move the arm by hand, by its side on a machine for both
        arms; None if there is none."""
        self._measured = twin.read()
        self._sequence, self._ahead_s = 0, 0.0
        self._frozen: dict[int, tuple[JointState, int]] = {}
        self.watch: Callable[[], object] | None = None
        """Callback after each step: of an examiner, or of a participant who feels a touch panel."""

    @property
    def now(self) -> float:
        """Time on the drives' clock, which is that of the first twin [s]."""
        return self._ahead_s + self.twin.t

    def change(self, twin: SimulatedMachine) -> None:
        """Put another twin behind the same drives. The clock continues, and the motors have their original wiring."""
        self._ahead_s += self.twin.t - twin.t
        self.twin, self._measured = twin, twin.read()
        self._of_current, self._brakes = self._wired, np.ones_like(self._brakes)

    def turn_motor(self, joint: int, factor: float) -> None:
        """Multiply a motor's torque per current by `factor`; a negative factor turns the direction.

        The short-circuit brake of the motor changes by the square of the factor. An increase is not modelled.
        """
        self._of_current, self._brakes = self._of_current.copy(), self._brakes.copy()
        self._of_current[joint] *= factor
        self._brakes[joint] = min(self._brakes[joint] * factor**2, 1.0)
        self.twin.turn_motor(joint, factor)

    def step(self) -> None:
        """Advance the twin by one period. The present torques of the drives act for all of it."""
        twin, now = self.twin, self.twin.t
        self.before_step()
        self.outputs = outputs = tuple(drive.step(twin.period_s, self.now) for drive in self.each)
        current = self._of_current * [output.current for output in outputs]
        warm = twin.warm_gain([drive.temperature_C for drive in self.each])
        if warm is not None:
            self._warm, current = warm, current * warm
        damping = self._brakes * [output.damping for output in outputs]
        self._sequence += 1
        # The life of this command is longer than a step and the dead time, so that the twin's own watchdog does not
        # trip.
        twin.write(Command(now, self._sequence, now + COMMAND_LIFE_S, np.zeros_like(current), current, damping))
        self._measured = twin.read()
        if self.watch is not None:
            self.watch()

    @property
    def measured(self) -> JointState:
        """Measurement of the twin's sensors, in the joints' own directions; for examiners."""
        return self._measured

    def freeze(self, joint: int) -> None:
        """Let a drive report its present sample from now on, while its motor goes on."""
        self._frozen[joint] = self._image(joint)

    def thaw(self, joint: int) -> None:
        """Let a drive report new samples again."""
        self._frozen.pop(joint, None)

    def _image(self, joint: int) -> tuple[JointState, int]:
        """Newest sample that a drive reports, and its number."""
        return self._frozen.get(joint, (self._measured, self._sequence))

    def sample(self, joint: int) -> int:
        """Return the number of the newest sample that a drive reports."""
        return self._image(joint)[1]

    def position(self, joint: int) -> float:
        """Position at the drive's encoder on the joint [rad], in the drive's direction and from its own zero."""
        return float((self._image(joint)[0].q[joint] - self._offset[joint]) * self._of_encoder[joint])

    def motor_position(self, joint: int) -> float:
        """Position at the encoder on the motor's shaft [rad]; that of the joint's encoder if there is none."""
        q_motor = self._image(joint)[0].q_motor
        if q_motor is None:
            return self.position(joint)
        return float((q_motor[joint] - self._offset[joint]) * self._of_encoder[joint])

    def current(self, joint: int) -> float:
        """Return the current that the drive measures in its motor [A], in its own direction, whatever the torque is."""
        return float(self._image(joint)[0].current[joint] / (self._of_current[joint] * self._warm[joint]))

    def press_stop(self) -> None:
        """Press the hardware stop: every drive is off and brakes."""
        for drive in self.each:
            drive.fail(DriveFault.STOP_LINE)

    def release_stop(self) -> None:
        """Close the line of the hardware stop again; the drives stay off until they are enabled."""
        for drive in self.each:
            drive.fault &= ~DriveFault.STOP_LINE
