"""The machine on the bench, spoken to at its own pace: what every step of a bring-up is made of."""

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
    """What one period brought."""

    state: JointState
    status: tuple[DriveStatus, ...]
    at_s: float
    """Since the watch began [s]."""


class BenchMachine:
    """Reads and commands a machine without any feedback."""

    def __init__(self, rig: DrivenRig, drives: Drives, lock_step: bool = False):
        """Of drives; in lock-step nobody waits for the clock."""
        self.rig, self.lock_step = rig, lock_step
        self.rated = np.array([drive.current_rated_A for drive in drives.each])
        """Currents (joint,) [A]."""
        self._zero = np.zeros(len(rig.joints))

    def watch(
        self, seconds: float, until: Callable[[BenchSample], bool] | None = None, commands: bool = True
    ) -> tuple[list[BenchSample], bool]:
        """Look for so long, commanding no torque, or nothing at all; ends early where `until` is met, and says so."""
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
    """Whether every drive reports this fault."""
    return lambda seen: all(fault in status.fault for status in seen.status)


def positions(seen: list[BenchSample]) -> Float[np.ndarray, "tick joint"]:
    """Of all joints [rad]."""
    return np.array([one.state.q for one in seen])


def currents(seen: list[BenchSample]) -> Float[np.ndarray, "tick joint"]:
    """Of all motors [A]."""
    return np.array([one.state.current for one in seen])
