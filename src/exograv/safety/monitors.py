"""Two signals that should say the same: a joint's encoder and its motor's, a torque that was told and one that is.

Sources of all figures: docs/safety.md.
"""

from collections import deque
from collections.abc import Collection, Iterator, Sequence

from exograv.signals import JointState

from .envelope import StopReason

AGREE_RAD = 0.035
"""By which the two encoders of a joint may part: 2°, far more than a gear yields [rad]."""

OPPOSITE_RAD_S = 0.15
"""From which speed on two encoders that move in opposite directions are no noise [rad/s]."""

TORQUE_OFF_NM = 3.0
"""By which a motor's torque may be off what it was told lately [N·m]."""

LATELY_TICKS = 12
"""So long a command may be on its way and a motor's torque behind it [-]."""

IN_A_ROW = 10
"""Ticks after which it is a fault [-]."""

SPEED_TICKS = 8
"""Over which the two speeds are taken [-]."""

STILL_TICKS, STILL_WAY_RAD = 20, 0.003
"""An encoder that says the same so often, to the bit, while its motor goes so far is dead: 0.15 rad/s, eight counts."""

Finding = tuple[StopReason, int]
"""What is wrong, and with which joint."""


class Monitors:
    """Of one machine; what it has no second signal for it does not watch."""

    def __init__(self, joints: int, period_s: float, gain: Sequence[float] | None = None):
        """Nothing has been seen yet.

        Args:
            joints: How many.
            period_s: Between two measurements [s].
            gain: Torque per motor current, as calibrated [N·m/A]; None where torque is measured by sensors.
        """
        self._gain = None if gain is None else list(gain)
        self._apart = [_Apart(period_s) for _ in range(joints)]
        self._told: deque[list[float]] = deque(maxlen=LATELY_TICKS)
        self._off = [0] * joints

    def told(self, tau: Sequence[float]) -> None:
        """What went out (joint,) [N·m]."""
        self._told.append(list(tau))

    def look(self, state: JointState, ignored: Collection[int] = ()) -> Iterator[Finding]:
        """What a measurement that is believed otherwise gives away; joints in `ignored` are not asked."""
        yield from ((StopReason.DRIVE_FAULT, j) for j in state.faulty if j not in ignored)
        if state.q_motor is not None:
            both = zip(self._apart, state.q.tolist(), state.q_motor.tolist(), strict=True)
            for j, (apart, q, q_motor) in enumerate(both):
                if j not in ignored and apart.takes(q, q_motor):
                    yield StopReason.ENCODERS_PART, j
        yield from ((StopReason.TORQUE_WRONG, j) for j in self._wrong_torques(state) if j not in ignored)

    def _wrong_torques(self, state: JointState) -> Iterator[int]:
        if len(self._told) < LATELY_TICKS:
            return
        measured = state.tau.tolist()
        if self._gain is not None:
            measured = [g * i for g, i in zip(self._gain, state.current.tolist(), strict=True)]
        for j, (tau, newest) in enumerate(zip(measured, self._told[-1], strict=True)):
            # A torque that is not a number is the ingress' to find.
            is_off = abs(tau - newest) > TORQUE_OFF_NM and self._is_off_lately(j, tau)
            self._off[j] = self._off[j] + 1 if is_off else 0
            if self._off[j] >= IN_A_ROW:
                yield j

    def _is_off_lately(self, joint: int, tau: float) -> bool:
        """Whether it is off everything that the joint was told lately, not only the newest."""
        lately = [told[joint] for told in self._told]
        return tau > max(lately) + TORQUE_OFF_NM or tau < min(lately) - TORQUE_OFF_NM


class _Apart:
    """The two encoders of one joint."""

    def __init__(self, period_s: float):
        self._least_way = OPPOSITE_RAD_S * SPEED_TICKS * period_s
        self._first: float | None = None
        self._last: deque[tuple[float, float]] = deque(maxlen=SPEED_TICKS + 1)
        self._ticks = self._still = 0
        self._q_still, self._q_motor_still = float("nan"), 0.0

    def takes(self, q: float, q_motor: float) -> bool:
        """Whether they have parted: farther than at first, or in opposite directions, for some time."""
        difference = q - q_motor
        if self._first is None:
            self._first = difference
        self._last.append((q, q_motor))
        before, before_motor = self._last[0]
        way, way_motor = q - before, q_motor - before_motor
        is_opposite = way * way_motor < 0.0 and min(abs(way), abs(way_motor)) > self._least_way
        is_apart = abs(difference - self._first) > AGREE_RAD
        self._ticks = self._ticks + 1 if is_opposite or is_apart else 0
        return self._ticks >= IN_A_ROW or self._is_dead(q, q_motor)

    def _is_dead(self, q: float, q_motor: float) -> bool:
        """Whether the joint's encoder stands still to the bit while the motor goes on."""
        if q != self._q_still:
            self._q_still, self._q_motor_still, self._still = q, q_motor, 0
        self._still += 1
        return self._still > STILL_TICKS and abs(q_motor - self._q_motor_still) > STILL_WAY_RAD
