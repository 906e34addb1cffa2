"""Phases of a session with an arm: their order, the drive of the arm in each, the way to each, and the ramps.

Two clocks read this table. A run in lock-step follows trajectories and fades (`Pilot`, `mode_ramp`). The live loop
follows the modes of its state machine, tick by tick (`LiveControl`). `safety.modes` holds the transitions between
modes, and the ramps of the arm's share.
"""

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from exograv import motion
from exograv.motion import Joints, Trajectory
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.safety.modes import WORN, Mode

DRIVE_S = 1.0
"""Ramp of feedback, inertial feed-forward and the wearer's passive torque, from 0 to 1 [s]."""

RAMPS_S: Mapping[str, float] = MappingProxyType({"drive": DRIVE_S, "gravity_level": GRAVITY_LEVEL_S})
"""Ramp of each field of the controller's mode, by the field's name [s]."""

TRAVEL_RAD_S = 0.6
"""Velocity of the fastest joint while a relaxed arm moves to a posture [rad/s]."""


class Drive(enum.Enum):
    """Cause of motion or support of the arm in a phase, besides the compensation of its weight."""

    NEVER = "Nothing: the arm is free."
    UNTIL_KNOWN = "Weak feedback, as long as the arm is not identified; then nothing."
    ALWAYS = "Weak feedback along a path."

    def goal(self, is_known: bool) -> float:
        """Goal of `drive` in the controller's mode [-]."""
        return float(self is Drive.ALWAYS or (self is Drive.UNTIL_KNOWN and not is_known))


@dataclass(frozen=True)
class Phase:
    """Phase of a session."""

    recorded: str
    """Name of the phase in the recording of a run in lock-step. Live runs record the names of modes instead."""

    drive: Drive

    settle_s: float = 0.0
    """Time of rest at the first posture before the phase begins [s]."""

    def approach(self, q: Joints, posture: Joints, dt: float) -> Trajectory:
        """Motion from `q` to the phase's first posture [rad], with the rest there, at the period `dt` [s]."""
        return motion.joined([motion.go_to(q, posture, TRAVEL_RAD_S, dt), motion.hold(posture, self.settle_s, dt)])

    def passage(self, q: Joints, posture: Joints, dt: float) -> motion.Passage:
        """Return the motion of `approach` without its table."""
        return motion.Passage.planned(q, posture, TRAVEL_RAD_S, self.settle_s, dt)


ON_THE_WAY = Phase("move", Drive.ALWAYS)
"""Motion from one phase to the next."""

TAKING = Phase("take arm", Drive.NEVER)
"""The machine takes the arm while the wearer lets go."""

ARM_CHECK = Phase("check arm", Drive.ALWAYS)
# a strained relaxed joint decays with about 1 s (docs/explanation/arm.md)
RESTING = Phase("rest", Drive.ALWAYS, settle_s=1.5)
IDENTIFICATION = Phase("identify", Drive.ALWAYS, settle_s=0.5)
VERIFICATION = Phase("verify", Drive.ALWAYS)
SESSION_CHECK = Phase("check session", Drive.ALWAYS, settle_s=0.5)
"""The motion of the identification is repeated between two windows."""
REST_LEARNING = Phase("learn in rest", Drive.ALWAYS, settle_s=0.5)
"""The machine moves the relaxed arm between two windows and learns it."""
FLOATING = Phase("float", Drive.UNTIL_KNOWN, settle_s=1.0)
LAYING_DOWN = Phase("lay down", Drive.ALWAYS, settle_s=1.0)
WEIGHING = Phase("weigh", Drive.ALWAYS, settle_s=1.0)


def phases_of_unknown_arm(is_verified: bool) -> tuple[Phase, ...]:
    """Phases of an arm that is not known yet, in order.

    A driven phase ends after its path, as soon as the guard has the limits for the next phase. In lock-step this is
    at once; live, it is when the worker has judged the samples. Floating ends after a fixed time.
    """
    return (IDENTIFICATION, VERIFICATION, FLOATING) if is_verified else (IDENTIFICATION, FLOATING)


BY_MODE: Mapping[Mode, Drive] = MappingProxyType(
    {
        Mode.RAMP_IN: Drive.UNTIL_KNOWN,
        Mode.FLOATING: FLOATING.drive,
        Mode.MOVING: IDENTIFICATION.drive,
        Mode.WEIGHING: Drive.UNTIL_KNOWN,  # In a live run, the arm floats while a weight is weighed.
        Mode.RAMP_OUT: Drive.NEVER,
    }
)
"""Drive in each live mode in which the machine is worn."""


def next_drive(drive: float, mode: Mode, is_known: bool, period_s: float) -> float:
    """`drive` of the controller's mode one tick later [-]: on its ramp while the machine is worn, else 0 at once."""
    if mode not in WORN:
        return 0.0
    step = period_s / DRIVE_S
    return min(drive + step, 1.0) if BY_MODE[mode].goal(is_known) else max(drive - step, 0.0)
