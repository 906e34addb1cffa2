"""Targets of a reach test, and the rule for a reached target, independent of machine and clock.

Tests of the reachable workspace describe it about the shoulder, by directions and shares of the arm's length: front and
side, below, at and above the shoulder, arm nearly straight. These targets follow them; their numbers are our own
(docs/howto/support_level.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.model.description import RigDescription

Place = Float[np.ndarray, " 3"]

TOLERANCE_M = 0.05
"""Distance from the target's centre at which the fingertip has reached it [m]: the size of a cup, assumed."""

DWELL_S = 0.3
"""Time for which the fingertip must stay there [s]. An arm that only swings past is not held."""

TIME_S = 6.0
"""Time for one attempt [s]; assumed: several times the duration of an unhurried reach."""


@dataclass(frozen=True)
class Target:
    """Point relative to the shoulder's centre."""

    outward_deg: float
    """Angle from straight ahead to the arm's own side [°]."""

    up_deg: float
    """Angle above the horizontal through the shoulder [°]."""

    share: float
    """Distance as a share of the arm's length, shoulder to fingertip [-]."""

    def place(self, shoulder: Place, length: float, side: str) -> Place:
        """Position in the base frame [m], for an arm of this length [m] at this shoulder."""
        outward, up = np.deg2rad([self.outward_deg, self.up_deg])
        y = np.sin(outward) * (-1.0 if side == "right" else 1.0)
        level = np.cos(up)
        return shoulder + self.share * length * np.array([level * np.cos(outward), level * y, np.sin(up)])


FAR, NEAR = 0.88, 0.65

TARGETS = tuple(
    [Target(outward, up, FAR) for up in (-40.0, -15.0, 10.0) for outward in (-10.0, 15.0, 40.0)]
    + [Target(15.0, up, NEAR) for up in (-25.0, -10.0, 10.0)]
)
"""Twelve targets of the test.

Nine with the arm nearly straight: at hip, chest and head height, each across the body, ahead and to the side. Three
nearer ones ahead, one above the other.
"""


@dataclass
class ReachJudge:
    """Judge of one attempt: decides if the fingertip stayed at the target long enough."""

    place: Place
    """Position of the target, base frame [m]."""

    reached: bool = field(init=False, default=False)
    nearest_m: float = field(init=False, default=float("inf"))
    """Smallest distance so far [m]."""

    _since: float | None = field(init=False, default=None)

    def see(self, t: float, tip: Sequence[float] | Place) -> bool:
        """Take the fingertip at time `t` [s], base frame [m]. Return True if the target has been reached."""
        distance = float(np.linalg.norm(np.asarray(tip) - self.place))
        self.nearest_m = min(self.nearest_m, distance)
        if distance > TOLERANCE_M:
            self._since = None
        else:
            self._since = t if self._since is None else self._since
            self.reached = self.reached or t - self._since >= DWELL_S
        return self.reached


def refuse_without_targets(description: RigDescription) -> None:
    """Refuse a machine for which the targets are not made.

    Raises:
        ConfigError: The machine does not have the four joints of one arm.
    """
    if len(description.joints) != 4 or description.settings.donning.arm_posture_deg:
        raise ConfigError(
            f"{description.name} does not have the four joints of one arm, for which the targets are made. Choose "
            "recupera_like or recupera_like_qdd."
        )
