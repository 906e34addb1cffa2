"""The targets of a reach test, and when one counts as reached; nothing here knows a machine or a clock.

Tests of the reachable workspace describe it about the shoulder, in directions and shares of the arm's length: front and
side, below, at and above the shoulder, arm nearly straight. So do we; the numbers are ours (docs/support_level.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

Place = Float[np.ndarray, " 3"]

TOLERANCE_M = 0.05
"""From the target's centre, within which the fingertip is at it [m]: the size of a cup, assumed."""

DWELL_S = 0.3
"""For which it has to stay there [s]: who only swings past does not hold the arm."""

TIME_S = 6.0
"""For one attempt [s]; assumed: some times as long as an unhurried reach."""


@dataclass(frozen=True)
class Target:
    """A point about the shoulder's centre."""

    outward_deg: float
    """From straight ahead to the arm's own side."""

    up_deg: float
    """Above the horizontal through the shoulder."""

    share: float
    """Of the arm's length, shoulder to fingertip [-]."""

    def place(self, shoulder: Place, length: float, side: str) -> Place:
        """In the base frame [m], for an arm of this length [m] at this shoulder."""
        outward, up = np.deg2rad([self.outward_deg, self.up_deg])
        y = np.sin(outward) * (-1.0 if side == "right" else 1.0)
        level = np.cos(up)
        return shoulder + self.share * length * np.array([level * np.cos(outward), level * y, np.sin(up)])


FAR, NEAR = 0.88, 0.65

TARGETS = tuple(
    [Target(outward, up, FAR) for up in (-40.0, -15.0, 10.0) for outward in (-10.0, 15.0, 40.0)]
    + [Target(15.0, up, NEAR) for up in (-25.0, -10.0, 10.0)]
)
"""Nine with the arm nearly straight and three nearer: hip, chest and head height, across, ahead and to the side."""


@dataclass
class ReachJudge:
    """Sees where the fingertip is, and tells whether it was at the target for long enough."""

    place: Place
    """Of the target, base frame [m]."""

    reached: bool = field(init=False, default=False)
    nearest_m: float = field(init=False, default=float("inf"))
    """Least distance so far."""

    _since: float | None = field(init=False, default=None)

    def see(self, t: float, tip: Sequence[float] | Place) -> bool:
        """The fingertip at time `t` [s], base frame [m]; whether the target is reached by now."""
        distance = float(np.linalg.norm(np.asarray(tip) - self.place))
        self.nearest_m = min(self.nearest_m, distance)
        if distance > TOLERANCE_M:
            self._since = None
        else:
            self._since = t if self._since is None else self._since
            self.reached = self.reached or t - self._since >= DWELL_S
        return self.reached
