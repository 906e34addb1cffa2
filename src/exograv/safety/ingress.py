"""Checks of each measurement before it is used: finite values, order, age, jumps and dead encoders.

Sources of all figures: docs/explanation/safety.md.
"""

import math
from collections import deque
from collections.abc import Collection, Sequence
from itertools import islice
from typing import NamedTuple

from exograv.errors import ConfigError
from exograv.signals import JointState, TorqueSource

from .period import ticks_of
from .stops import Finding, StopReason

AGE_MAX_S = 0.003
"""Largest age of a measurement that is used [s]."""

JUMP_SHARE = 1.5
"""Limit of a position jump, as a multiple of the way of the fastest joint in one tick [-]."""

JUMPS_MAX = 3
"""Jumps in a row that are a fault; fewer are a spike."""

FROZEN_MS = 20
"""Time without a change of any bit, after a motion, by which an encoder is dead [ms].

A joint never comes to rest like that.
"""

FROZEN_FROM_RAD_S = 0.2
"""Speed from which on a frozen encoder is certain to be dead [rad/s]."""

MOVING_MS, MOVING_COUNTS = 5, 4
"""Time just before the freeze [ms] in which the joint was that fast, and encoder counts that it moved.

From such a motion a joint cannot come to rest within one count. That would take a braking of more than 50 rad/s², and
no motor brakes an arm so hard.
"""


COARSEST_COUNT_RAD = 2.0 * math.pi / 2**13
"""Encoder count of a machine that does not state its own [rad].

It is the coarsest of the machines that we know.
"""


class IngressResult(NamedTuple):
    """Result of the check in one tick."""

    state: JointState | None
    """Measurement that may be used; None if there is none."""

    found: tuple[Finding, ...] = ()
    """Joints whose encoder is certainly wrong, with the reason."""

    broken: frozenset[int] = frozenset()
    """Joints with a non-finite value."""


NOTHING = IngressResult(None)
_BY_CURRENT = TorqueSource.CURRENT  # the look-up of an enum member takes as long as the check of a joint


class Ingress:
    """Check of one machine's measurements, with the past values that it needs."""

    def __init__(self, counts_rad: Sequence[float], period_s: float, v_trip_rad_s: float):
        """Start a check that has seen no measurement yet.

        Args:
            counts_rad: Resolution of each joint's encoder [rad]; infinite if the joint is not watched.
            period_s: Time between two measurements [s].
            v_trip_rad_s: Largest allowed joint speed, as in the envelope [rad/s].

        Raises:
            ConfigError: A count is negative or NaN.
        """
        for j, count in enumerate(counts_rad):
            if not count >= 0.0:
                raise ConfigError(
                    f"The encoder of joint {j} has a count of {count} rad; allowed: 0 and above, infinite where it is "
                    "not watched. Correct it in the rig file."
                )
        way, self._joints = v_trip_rad_s * period_s, range(len(counts_rad))
        self._period_s, self._way = period_s, way
        self._reach = [JUMP_SHARE * way + count for count in counts_rad]
        self._slack = [(JUMP_SHARE - 1.0) * way + count for count in counts_rad]
        moving, frozen = ticks_of(MOVING_MS, period_s), ticks_of(FROZEN_MS, period_s)
        clear = FROZEN_FROM_RAD_S * moving * period_s
        self._least_way = [max(clear, MOVING_COUNTS * count) for count in counts_rad]
        # Comparisons with NaN are false, so values that were not seen yet raise no finding.
        looked_at, self._moving = moving + frozen + 1, moving
        self._used = deque([[math.nan] * len(counts_rad)] * looked_at, maxlen=looked_at)
        self._jumped = [0] * len(counts_rad)
        self._ignored: Collection[int] = ()
        self._sequence, self._t = -1, 0.0
        self.dropped = 0
        """Count of measurements that came twice or after a newer one; they are never used."""

    def see(self, state: JointState | None, now: float, ignored: Collection[int] = ()) -> IngressResult:
        """Check the measurement of one tick.

        Args:
            state: Measurement that came; None if nothing came.
            now: Time on the rig's clock [s].
            ignored: Isolated joints; their values do not spoil a measurement.
        """
        if ignored != self._ignored:
            self._forget(ignored)
        if state is None:
            return NOTHING
        if state.sequence <= self._sequence:
            self.dropped += 1
            return NOTHING
        self._sequence = state.sequence
        # A time in the future is not of this clock, and would excuse any jump.
        if not abs(now - state.t) <= AGE_MAX_S:
            return NOTHING
        torque = state.current if state.torque_source is _BY_CURRENT else state.tau
        q, other = state.q.tolist(), torque.tolist()
        if not math.isfinite(sum(q) + sum(other)):  # a sum is finite only if all its terms are
            believed = [j for j in self._joints if j not in ignored]
            broken = frozenset(j for j in believed if not (math.isfinite(q[j]) and math.isfinite(other[j])))
            if broken:
                return IngressResult(None, broken=broken)
        if ignored:
            q = [math.nan if j in ignored else at for j, at in enumerate(q)]
        if self._are_far(q, max(round((state.t - self._t) / self._period_s), 1)):
            jumped = [j for j, ticks in enumerate(self._jumped) if ticks >= JUMPS_MAX]
            return IngressResult(None, tuple((StopReason.ENCODER_JUMPED, j) for j in jumped))
        self._used.append(q)
        self._t = state.t
        return IngressResult(state, self._dead(q))

    def _are_far(self, q: list[float], ticks: int) -> bool:
        """Return True if a joint moved farther in so many ticks than it can."""
        jumped, before, reaches, are_far = self._jumped, self._used[-1], self._reach, False
        for j in self._joints:
            # After a first jump only the speed extends the reach, without the encoder count. Otherwise a small jump
            # would come within reach before the third tick.
            reach = ticks * self._way + self._slack[j] if jumped[j] else ticks * reaches[j]
            if abs(q[j] - before[j]) > reach:
                jumped[j], are_far = jumped[j] + 1, True
            else:
                jumped[j] = 0
        return are_far

    def _dead(self, q: list[float]) -> tuple[Finding, ...]:
        """Joints whose encoder has frozen after a clear motion."""
        moving, still, found = self._used[0], self._used[self._moving], ()
        for j in self._joints:
            if q[j] == still[j] and abs(q[j] - moving[j]) >= self._least_way[j]:
                is_dead = all(one[j] == q[j] for one in islice(self._used, self._moving, None))
                found += ((StopReason.ENCODER_DEAD, j),) if is_dead else ()
        return found

    def _forget(self, joints: Collection[int]) -> None:
        """Forget the earlier positions of these joints: their motion is unknown when their values are trusted again."""
        self._ignored = joints
        for q in self._used:
            for j in joints:
                q[j] = math.nan
