"""What a machine says is looked at before anybody believes it: numbers, order, age, jumps, and dead encoders.

Sources of all figures: docs/safety.md.
"""

import enum
import math
from collections import deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from exograv.signals import JointState, TorqueSource

AGE_MAX_S = 0.003
"""Up to which a measurement is of now [s]."""

JUMP_SHARE = 1.5
"""Of the way that the fastest joint makes in one tick, beyond which a position jumped [-]."""

JUMPS_MAX = 3
"""In a row, with which a jump is no spike."""

FROZEN_TICKS = 20
"""Of the same bits, with which a joint that was moving has a dead encoder: a joint does not stop within one tick."""

FROZEN_FROM_RAD_S = 0.2
"""Speed from which on that is certain [rad/s]."""

MOVING_TICKS, MOVING_COUNTS = 5, 4
"""Just before, in which the joint must have been so fast, and moved by so many counts of its encoder: from there nobody
comes to rest within one count, braked by 50 rad/s², which is more than any motor does to an arm."""


COARSEST_COUNT_RAD = 2.0 * math.pi / 2**14
"""Of the encoders of machines that we know of: what a machine that does not say is taken to have [rad]."""


class Doubt(enum.Enum):
    """What is wrong with a measurement; the value is a sentence for the operator."""

    NOT_FINITE = "An encoder or a current is not a number."
    JUMP = "An encoder jumped farther than a joint can move."
    FROZEN = "An encoder stood still while its joint was moving."
    MISSING = "No measurement came."
    STALE = "A measurement is too old, or of a time to come."
    OUT_OF_ORDER = "A measurement came twice, or after a newer one."


@dataclass(frozen=True)
class Seen:
    """What one tick brought."""

    state: JointState | None
    """A measurement that may be used; None where there is none."""

    doubts: tuple[tuple[Doubt, int | None], ...] = ()
    """Each with the joint that it is about, None for all of them."""


class Ingress:
    """Of one machine; remembers what it needs to judge the next measurement by."""

    def __init__(self, counts_rad: Sequence[float], period_s: float, v_trip_rad_s: float):
        """Nothing has been seen yet.

        Args:
            counts_rad: Of each joint's encoder, the least change that it can tell [rad].
            period_s: Between two measurements [s].
            v_trip_rad_s: As in the envelope: faster no joint is allowed to be [rad/s].
        """
        self._period_s = period_s
        self._joints = range(len(counts_rad))
        self._encoders = [_Encoder(JUMP_SHARE * v_trip_rad_s * period_s, count, period_s) for count in counts_rad]
        self._sequence, self._t = -1, -math.inf
        self.dropped = 0
        """Measurements that came twice or after a newer one: counted, and never used."""

    def see(self, state: JointState | None, now: float, ignored: Collection[int] = ()) -> Seen:
        """One tick.

        Args:
            state: What came, None if nothing.
            now: On the rig's clock [s].
            ignored: Joints that are not believed any more: what they say makes no measurement worse.
        """
        for j in ignored:
            self._encoders[j].forget()
        if state is None:
            return Seen(None, ((Doubt.MISSING, None),))
        if state.sequence <= self._sequence:
            self.dropped += 1
            return Seen(None, ((Doubt.OUT_OF_ORDER, None),))
        self._sequence = state.sequence
        # A time to come is no time of this clock, and would excuse any jump.
        if not abs(now - state.t) <= AGE_MAX_S:
            return Seen(None, ((Doubt.STALE, None),))
        q, other = state.q.tolist(), _measured(state)
        believed = [j for j in self._joints if j not in ignored] if ignored else self._joints
        broken = [j for j in believed if not (math.isfinite(q[j]) and math.isfinite(other[j]))]
        if broken:
            return Seen(None, tuple((Doubt.NOT_FINITE, j) for j in broken))
        ticks = max(round((state.t - self._t) / self._period_s), 1) if math.isfinite(self._t) else 1
        # All of them look, whatever the first one finds.
        jumped = [j for j in believed if self._encoders[j].jumps(q[j], ticks)]
        if jumped:
            certain = (j for j in jumped if self._encoders[j].jumped >= JUMPS_MAX)
            return Seen(None, tuple((Doubt.JUMP, j) for j in certain))
        self._t = state.t
        frozen = [j for j in believed if self._encoders[j].is_frozen(q[j])]
        return Seen(state, tuple((Doubt.FROZEN, j) for j in frozen))


class _Encoder:
    """The last positions of one joint."""

    def __init__(self, jump_rad: float, count_rad: float, period_s: float):
        self._jump = jump_rad + count_rad
        self._way = max(FROZEN_FROM_RAD_S * MOVING_TICKS * period_s, MOVING_COUNTS * count_rad)
        self._last: deque[float] = deque(maxlen=MOVING_TICKS + FROZEN_TICKS + 1)
        self._newest, self._still = math.nan, 0
        self.jumped = 0
        """Positions in a row that were too far off."""

    def forget(self) -> None:
        """Nothing was seen: when the joint is believed again, nobody knows how it came to where it is."""
        self._last.clear()
        self._newest, self._still, self.jumped = math.nan, 0, 0

    def jumps(self, q: float, ticks: int) -> bool:
        """Whether it is farther off the last position that was used than the joint can have come in so many ticks."""
        is_far = abs(q - self._newest) > ticks * self._jump
        self.jumped = self.jumped + 1 if is_far else 0
        return is_far

    def is_frozen(self, q: float) -> bool:
        """Use this position; whether it has been the same for long after a clear motion."""
        self._still = self._still + 1 if q == self._newest else 0
        self._newest = q
        last = self._last
        last.append(q)
        return self._still >= FROZEN_TICKS and len(last) == last.maxlen and abs(q - last[0]) >= self._way


def _measured(state: JointState) -> list[float]:
    """Currents, or torques where the machine has sensors for them."""
    values = state.current if state.torque_source is TorqueSource.CURRENT else state.tau
    return values.tolist()
