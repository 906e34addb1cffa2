"""Bench machine without feedback: reads, zero-torque commands and samples that each bring-up step uses."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.rig.drive_status import DriveFault, DriveStatus
from exograv.rig.drives.opening import DrivenRig
from exograv.rig.drives.settings import Drives
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.guard import COMMAND_LIFE_S
from exograv.signals import Command, JointState


@dataclass(frozen=True)
class BenchSample:
    """Measurement of one period."""

    state: JointState
    status: tuple[DriveStatus, ...]
    at_s: float
    """Time since the watch began [s]."""


class BenchMachine:
    """Machine on the bench. Motors are commanded zero torque, without feedback."""

    def __init__(self, rig: DrivenRig, drives: Drives, lock_step: bool = False):
        """Wrap the rig of drives. In lock-step, `watch` does not wait for the wall clock."""
        self.rig, self.lock_step = rig, lock_step
        self.rated = np.array([drive.current_rated_A for drive in drives.each])
        """Rated motor currents (joint,) [A]."""
        self._zero = np.zeros(len(rig.joints))

    def watch(
        self, seconds: float, until: Callable[[BenchSample], bool] | None = None, commands: bool = True
    ) -> tuple[list[BenchSample], bool]:
        """Record samples for `seconds`, commanding zero torque, or no command at all.

        Return the samples, and True if `until` was met; the watch ends there.
        """
        pace, begun, found = RealTimePace(self.rig.period_s), self.rig.t, list[BenchSample]()
        while (passed := self.rig.t - begun) < seconds:
            state = self.rig.read()
            found.append(BenchSample(state, self.rig.status(), passed))
            if until is not None and until(found[-1]):
                return found, True
            if commands:
                now = self.rig.t
                self.rig.write(Command(now, state.sequence, now + COMMAND_LIFE_S, self._zero, self._zero, self._zero))
            if not self.lock_step:
                pace.wait()
        return found, False


def all_say(fault: DriveFault) -> Callable[[BenchSample], bool]:
    """Return a test that is True if every drive reports this fault."""
    return lambda seen: all(fault in status.fault for status in seen.status)


def positions(seen: list[BenchSample]) -> Float[np.ndarray, "tick joint"]:
    """Positions of all joints [rad]."""
    return np.array([one.state.q for one in seen])


def currents(seen: list[BenchSample]) -> Float[np.ndarray, "tick joint"]:
    """Currents of all motors [A]."""
    return np.array([one.state.current for one in seen])
