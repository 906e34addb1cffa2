"""The arm is let go: nothing drives it, its weight is taken away to the wanted level, and what it does is watched."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion

from .arm_controller import ArmController
from .identify import SKELETON_TICKS, record_skeleton
from .pilot import Moment, Pilot

RELEASE_S = 1.0  # feedback and inertial feed-forward fade out over this time
LEVEL_S = 5.0  # the gravity level changes over this time: 11 N·m, a heavy arm, at 3.4 N·m/s (docs/safety.md)
TRAVEL = 0.6  # rad/s


@dataclass(frozen=True)
class Drift:
    """What the floated arm did by itself."""

    drift_deg: Float[np.ndarray, " joint"]
    """Farthest from where it was let go."""

    window_s: float


class _Fade:
    """Moves one field of the controller's mode from where it is to a goal, a little every tick."""

    def __init__(self, controller: ArmController, field: str, goal: float, ticks: int):
        self._mode, self._field, self._goal = controller.mode, field, goal
        self._step = (goal - getattr(self._mode, field)) / ticks
        self._left = ticks

    def __call__(self, _moment: Moment) -> None:
        self._left -= 1
        value = self._goal if self._left <= 0 else getattr(self._mode, self._field) + self._step
        setattr(self._mode, self._field, value)


def float_arm(
    pilot: Pilot,
    controller: ArmController,
    posture: Float[np.ndarray, " joint"],
    gravity_level: float,
    window_s: float,
    phase: str = "float",
) -> Drift:
    """Bring the arm to a posture [rad], let go, and watch it for `window_s`; `phase` names the watch in the recording.

    Raises:
        RigError: The envelope stopped the run.
    """
    dt = pilot.rig.period_s
    pilot.begin("move")
    controller.mode.drive = 1.0
    approach = motion.joined([motion.go_to(pilot.q, posture, TRAVEL, dt), motion.hold(posture, 1.0, dt)])
    pilot.run(controller, approach, "Moving to where the arm is let go")
    _fade(pilot, controller, "gravity_level", gravity_level, LEVEL_S if gravity_level else dt, posture)
    _fade(pilot, controller, "drive", 0.0, RELEASE_S, posture)
    pilot.begin(phase)
    start = pilot.q.copy()
    farthest = np.zeros_like(start)
    ticks = 0

    def watch(moment: Moment) -> None:
        nonlocal ticks
        np.maximum(farthest, np.abs(moment.state.q - start), out=farthest)
        ticks += 1
        if ticks % SKELETON_TICKS == 0:
            record_skeleton(pilot, controller, moment)

    pilot.run(controller, motion.hold(start, window_s, dt), f"Floating at gravity level {gravity_level:g}", watch)
    return Drift(np.rad2deg(farthest), window_s)


def _fade(
    pilot: Pilot,
    controller: ArmController,
    field: str,
    goal: float,
    seconds: float,
    posture: Float[np.ndarray, " joint"],
) -> None:
    dt = pilot.rig.period_s
    pilot.run(
        controller, motion.hold(posture, seconds, dt), "Letting go", _Fade(controller, field, goal, round(seconds / dt))
    )
