"""Conversion between a drive's numbers and those of its joint: signs, counts, offsets and limits of `drives.toml`."""

import math

import numpy as np
from jaxtyping import Float, Shaped

from exograv.errors import RigError
from exograv.signals import Command

from .settings import Drives

Joints = Float[np.ndarray, " joint"]
Reported = Shaped[np.ndarray, " joint"]
"""Radians, or whole counts."""


class Units:
    """Conversions of one machine."""

    def __init__(self, drives: Drives):
        self._joints = drives.joints
        self._sign, self._offset = drives.sign, drives.offset
        self._of_count = drives.sign * drives.rad_per_count
        per_motor_count = drives.rad_per_motor_count
        self._of_motor_count = None if per_motor_count is None else drives.sign * per_motor_count
        self._current_max = np.array([drive.current_max_A for drive in drives.each])
        self.limited = 0
        """Number of commands in which a current was cut to the drive's limit."""

    def positions(self, reported: Reported) -> Joints:
        """Positions of the joints [rad] from the reported positions."""
        return self._offset + self._of_count * reported

    def motor_positions(self, reported: Reported) -> Joints | None:
        """Positions from the motors' encoders, as angles of the joints [rad]; None if a drive has no such encoder."""
        if self._of_motor_count is None or not math.isfinite(sum(reported.tolist())):
            return None
        return self._offset + self._of_motor_count * reported

    def joint_currents(self, measured: Joints) -> Joints:
        """Currents in the joints' directions [A]."""
        return self._sign * measured

    def drive_currents(self, command: Command) -> Joints:
        """Currents in the drives' directions, limited to the drives' largest currents [A].

        Raises:
            RigError: A current or a damping is not finite.
        """
        return self._sign * self.within_limits(command)

    def within_limits(self, command: Command) -> Joints:
        """Currents of a command in the joints' directions, cut to the drives' limits [A]; cuts are counted.

        Raises:
            RigError: A current or a damping is not finite.
        """
        damping = () if command.damping is None else command.damping.tolist()
        if not math.isfinite(sum(command.current.tolist()) + sum(damping)):
            self._refuse(command)
        limited = np.minimum(np.maximum(command.current, -self._current_max), self._current_max)
        self.limited += bool((limited != command.current).any())
        return limited

    def _refuse(self, command: Command) -> None:
        damping = np.zeros_like(command.current) if command.damping is None else command.damping
        wrong = [
            joint
            for joint, i, d in zip(self._joints, command.current, damping, strict=True)
            if not (math.isfinite(i) and math.isfinite(d))
        ]
        raise RigError(
            f"Command {command.sequence} asks {', '.join(wrong) or 'the drives'} for a current or a damping that is "
            "not finite; none is sent, and the drives brake. The envelope must stop such a command before it is "
            "written."
        )
