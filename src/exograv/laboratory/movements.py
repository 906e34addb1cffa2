"""Movements of the wearer for the measurement of effort: the shipped pointing movement, or recorded reaching."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float

from exograv.motion import Trajectory, go_to, hold, joined, minimum_jerk

from .recorded_reaching import reaching_folder, read_reaching, smooth_path

PerFreedom = Float[np.ndarray, " arm"]

# Flexion, abduction, rotation, elbow. At rest the hand lies near the lap, the upper arm almost hanging. The target is
# the middle of a screen at chest height: for a person of 1.75 m the fingertip is 13 cm below and 67 cm before the
# shoulder and 8 cm towards the middle of the body, the elbow still bent. Both postures lie inside the task workspace.
REST_DEG = (5.0, 10.0, 25.0, 75.0)
TARGET_DEG = (52.0, 10.0, 31.0, 54.0)

TOUCHES = 8  # In 22 s, the pace of the paper: 2.75 s from touch to touch.
REACH_S = 0.9  # One way. Assumed: an unhurried reach, 2 rad/s at the fastest joint, leaves time to stay.
TOUCH_S = 0.45  # Time on the screen.
LAP_S = 0.5  # Time at rest.

# The first repetition of three of the six tasks: two ways of reaching out over several targets, and a hand to the face.
# With all six a repetition would last a minute, and practice of it a quarter of an hour.
RECORDED_PERSON, RECORDED_TASKS = "S01", (1, 2, 5)
JOIN_RAD_PER_S = 1.0  # Speed between recordings.
STAY_S = 0.3  # Pause before and after each recording.
LIMIT_MARGIN = np.deg2rad(5.0)  # A limb in soft cuffs is not exactly at the machine's angles.


@dataclass(frozen=True)
class WantedMovement:
    """Movement of the arm's freedoms that ends where it started."""

    name: str
    path: Trajectory
    repeats: int
    """Number of repetitions in a row while effort is measured."""

    practice: tuple[int, int]
    """Least and largest number of repetitions before. The least one prevents an advantage from a lucky start."""

    samples: int = 0
    """Number of samples of the recording; zero without one."""

    clipped: int = 0
    """Number of recorded samples beyond the machine's range, which were moved to its limit."""


def pointing(freedoms: int, dt: float) -> WantedMovement:
    """Return the movement from the lap to the screen and back. The wrist of an arm that has one stays straight."""
    rest, target = (np.deg2rad([*angles, *[0.0] * (freedoms - 4)]) for angles in (REST_DEG, TARGET_DEG))
    parts = [
        hold(rest, LAP_S / 2, dt),
        minimum_jerk(rest, target, REACH_S, dt),
        hold(target, TOUCH_S, dt),
        minimum_jerk(target, rest, REACH_S, dt),
        hold(rest, LAP_S / 2, dt),
    ]
    return WantedMovement("pointing", joined(parts), TOUCHES, practice=(12, 40))


def recorded(lower: PerFreedom, upper: PerFreedom, dt: float, folder: Path | None = None) -> WantedMovement:
    """Read reaching of people in another exoskeleton, within `lower` and `upper` [rad] of this machine's joints.

    Raises:
        RecordingError: The data are missing, or not as expected.
    """
    file = (folder or reaching_folder()) / f"{RECORDED_PERSON}_trajs.mat"
    measured = [read_reaching(file, task) for task in RECORDED_TASKS]
    within = [np.clip(q, lower + LIMIT_MARGIN, upper - LIMIT_MARGIN) for q in measured]
    clipped = sum(int((q != kept).any(axis=1).sum()) for q, kept in zip(measured, within, strict=True))
    paths, parts = [smooth_path(q, dt) for q in within], []
    for path, after in zip(paths, [*paths[1:], paths[0]], strict=True):
        join = go_to(path.q[-1], after.q[0], JOIN_RAD_PER_S, dt)
        parts += [hold(path.q[0], STAY_S, dt), path, hold(path.q[-1], STAY_S, dt), join]
    return WantedMovement("recorded", joined(parts), 1, (6, 16), sum(map(len, measured)), clipped)
