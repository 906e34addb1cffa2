"""A path waits for the arm: its time slows down while a joint is off the path, and stands still while it is far off.

Without it a path runs away from an arm that its wearer holds for a moment, or that the guard gives less than control
asks for; and the feedback that has grown meanwhile then pulls the arm after it, faster than anybody may be moved.
"""

import math

import numpy as np
from jaxtyping import Float

from exograv.motion import Trajectory
from exograv.signals import Reference

Joints = Float[np.ndarray, " joint"]

SLOWS_NM, STANDS_NM = 2.5, 4.5
"""Of torque that any joint's feedback asks for its position's sake: up to the first time runs as it should, from the
second on it stands [N·m]. The guard lets 3 N·m beyond 1.3 times the plausible torque pass, and takes 3 N·m that it
refuses a joint at rest for another arm; what waits has to stay within the two. With 4 and 7 N·m wearers of level 4
were still stopped for it (docs/safety.md)."""

LAG_S, RISE_S = 0.05, 0.3
"""Of the two lags through which the rate follows: twice `LAG_S` down, `RISE_S` and `LAG_S` up [s]. It is never steeper
than 1 / (e LAG_S), so that a motion of 1.2 rad/s slows down with no more than 8.8 rad/s². Up it takes longer, for an
arm that has just come is soon off again, and the guard's tank fills meanwhile."""

PATIENCE_S, PATIENCE_SHARE = 30.0, 0.5
"""So long a path waits at most [s], and half a second longer for every second in which it went on [-]. A wearer of
level 4 holds on for more than ten."""


class Governor:
    """The time of one path."""

    def __init__(self, kp: Joints, period_s: float):
        """At the path's beginning, at full rate.

        Args:
            kp: Stiffness of the feedback (joint,) [N·m/rad].
            period_s: Of the loop and of the path's table [s].
        """
        self._kp, self._period_s = kp, period_s
        self._share, self._rise = (1.0 - math.exp(-period_s / lag_s) for lag_s in (LAG_S, RISE_S))
        self._most, self._off = STANDS_NM / kp, np.zeros(len(kp))
        self.at = 0.0
        """Where on the path the arm should be, in ticks of its table [-]."""
        self.rate = self._sought = 1.0
        """Of the path's time against the clock's, 0 to 1 [-]."""
        self.slope = 0.0
        """Of the rate [1/s]."""
        self.waited_s = 0.0
        """Of `PATIENCE_S`: for how long the path has waited lately [s]."""

    @property
    def gives_up(self) -> bool:
        """Whether the arm was waited for long enough."""
        return self.waited_s > PATIENCE_S

    def step(self, ticks: int = 1) -> None:
        """So many periods pass, after `reference`."""
        wanted = rate_at(self._kp * self._off)
        for _ in range(ticks):
            before = self.rate
            share = self._share if wanted < self._sought else self._rise
            self._sought += share * (wanted - self._sought)
            self.rate += self._share * (self._sought - self.rate)
            self.slope = (self.rate - before) / self._period_s
            self.at += self.rate
            self.waited_s += self._period_s * (1.0 - self.rate - PATIENCE_SHARE * self.rate)
            self.waited_s = max(self.waited_s, 0.0)

    def reference(self, path: Trajectory, q: Joints, begins_at: int = 0) -> Reference:
        """What is asked for now; its velocity and acceleration are those of the path's position in the clock's time.

        A joint so far off that its feedback would ask for more than `STANDS_NM` is asked for a nearer position: who is
        pushed back while the path waits is not pulled the harder for it.

        Args:
            path: The part of the path in which the arm should be.
            q: Where it is [rad].
            begins_at: How much of the path came before that part, in ticks.
        """
        at = min(max(self.at - begins_at, 0.0), len(path) - 1.0)
        k, rest = int(at), at % 1.0
        rows = path.q[k], path.v[k], path.a[k]
        if rest:
            after = path.q[k + 1], path.v[k + 1], path.a[k + 1]
            rows = tuple((1.0 - rest) * row + rest * later for row, later in zip(rows, after, strict=True))
        q_path, v, a = rows
        self._off = off = q_path - q
        q_asked = np.where(np.abs(off) <= self._most, q_path, q + np.clip(off, -self._most, self._most))
        return Reference(q_asked, self.rate * v, self.rate**2 * a + self.slope * v)


def rate_at(tau_feedback: Joints) -> float:
    """At which rate a path's time should run while feedback asks for so much [N·m], 0 to 1 [-]."""
    s = (STANDS_NM - float(np.abs(tau_feedback).max())) / (STANDS_NM - SLOWS_NM)
    s = min(max(s, 0.0), 1.0)
    return 3.0 * s**2 - 2.0 * s**3
