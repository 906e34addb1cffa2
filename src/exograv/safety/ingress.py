"""What a machine says is looked at before anybody believes it: numbers, order, age, jumps, and dead encoders.

Sources of all figures: docs/safety.md.
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
"""Up to which a measurement is of now [s]."""

JUMP_SHARE = 1.5
"""Of the way that the fastest joint makes in one tick, beyond which a position jumped [-]."""

JUMPS_MAX = 3
"""In a row, with which a jump is no spike."""

FROZEN_MS = 20
"""Of the same bits, with which a joint that was moving has a dead encoder: no joint comes to rest so [ms]."""

FROZEN_FROM_RAD_S = 0.2
"""Speed from which on that is certain [rad/s]."""

MOVING_MS, MOVING_COUNTS = 5, 4
"""Just before [ms], in which the joint must have been so fast, and moved by so many counts of its encoder: from there
nobody comes to rest within one count, braked by 50 rad/s², which is more than any motor does to an arm."""


COARSEST_COUNT_RAD = 2.0 * math.pi / 2**13
"""Of the encoders of machines that we know of: what a machine that does not say is taken to have [rad]."""


class IngressResult(NamedTuple):
    """What one tick brought."""

    state: JointState | None
    """A measurement that may be used; None where there is none."""

    found: tuple[Finding, ...] = ()
    """Joints whose encoder is certainly not to be believed any more."""

    broken: frozenset[int] = frozenset()
    """Joints that said what is no number."""


NOTHING = IngressResult(None)
_BY_CURRENT = TorqueSource.CURRENT  # to look up a member of an enum takes as long as to judge a joint


class Ingress:
    """Of one machine; remembers what it needs to judge the next measurement by."""

    def __init__(self, counts_rad: Sequence[float], period_s: float, v_trip_rad_s: float):
        """Nothing has been seen yet.

        Args:
            counts_rad: Of each joint's encoder, the least change that it can tell [rad]; infinite where it is not
                watched.
            period_s: Between two measurements [s].
            v_trip_rad_s: As in the envelope: faster no joint is allowed to be [rad/s].

        Raises:
            ConfigError: A count is negative or no number.
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
        # No number is far from another, or the same: what has not been seen yet raises no doubt.
        looked_at, self._moving = moving + frozen + 1, moving
        self._used = deque([[math.nan] * len(counts_rad)] * looked_at, maxlen=looked_at)
        self._jumped = [0] * len(counts_rad)
        self._ignored: Collection[int] = ()
        self._sequence, self._t = -1, 0.0
        self.dropped = 0
        """Measurements that came twice or after a newer one: counted, and never used."""

    def see(self, state: JointState | None, now: float, ignored: Collection[int] = ()) -> IngressResult:
        """One tick.

        Args:
            state: What came, None if nothing.
            now: On the rig's clock [s].
            ignored: Joints that are not believed any more: what they say makes no measurement worse.
        """
        if ignored != self._ignored:
            self._forget(ignored)
        if state is None:
            return NOTHING
        if state.sequence <= self._sequence:
            self.dropped += 1
            return NOTHING
        self._sequence = state.sequence
        # A time to come is no time of this clock, and would excuse any jump.
        if not abs(now - state.t) <= AGE_MAX_S:
            return NOTHING
        torque = state.current if state.torque_source is _BY_CURRENT else state.tau
        q, other = state.q.tolist(), torque.tolist()
        if not math.isfinite(sum(q) + sum(other)):  # it is only where all of them are
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
        """Whether any joint is farther from where it was so many ticks ago than it can be."""
        jumped, before, reaches, are_far = self._jumped, self._used[-1], self._reach, False
        for j in self._joints:
            # After a first one by the speed alone: else a small jump would be within reach before it is the third.
            reach = ticks * self._way + self._slack[j] if jumped[j] else ticks * reaches[j]
            if abs(q[j] - before[j]) > reach:
                jumped[j], are_far = jumped[j] + 1, True
            else:
                jumped[j] = 0
        return are_far

    def _dead(self, q: list[float]) -> tuple[Finding, ...]:
        """Joints that have been the same for long after a clear motion."""
        moving, still, found = self._used[0], self._used[self._moving], ()
        for j in self._joints:
            if q[j] == still[j] and abs(q[j] - moving[j]) >= self._least_way[j]:
                is_dead = all(one[j] == q[j] for one in islice(self._used, self._moving, None))
                found += ((StopReason.ENCODER_DEAD, j),) if is_dead else ()
        return found

    def _forget(self, joints: Collection[int]) -> None:
        """Nothing was seen: when a joint is believed again, nobody knows how it came to where it is."""
        self._ignored = joints
        for q in self._used:
            for j in joints:
                q[j] = math.nan
