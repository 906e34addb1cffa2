"""Two signals that should say the same: a joint's encoder and its motor's, a torque that was told and one that is.

Sources of all figures: docs/safety.md.
"""

import math
from collections import deque
from collections.abc import Collection, Sequence
from itertools import islice

from exograv.signals import JointState

from .period import ticks_of
from .stops import Finding, StopReason

AGREE_RAD = 0.035
"""By which the two encoders of a joint may part: 2°, far more than a gear yields [rad]."""

OPPOSITE_RAD_S = 0.15
"""From which speed on two encoders that move in opposite directions are no noise [rad/s]."""

TORQUE_OFF_NM = 3.0
"""By which a motor's torque may be off what it was told lately [N·m]."""

LATELY_MS = 12
"""So long a command may be on its way and a motor's torque behind it [ms]."""

SLOWEST_MS = 30
"""So long the torque of a slow motor, of 8 Hz, may be behind for most of the way [ms]."""

IN_A_ROW_MS = 10
"""After which it is a fault [ms]."""

SPEED_MS = 8
"""Over which the two speeds are taken [ms]."""

STILL_MS, STILL_WAY_RAD = 20, 0.003
"""An encoder that says the same for so long, to the bit, while its motor goes so far is dead: 0.15 rad/s, eight counts
[ms], [rad]."""

TORQUE_BIAS_NM = 2.0
"""By which a motor's torque may be off what it was told on average [N·m]."""

BIAS_S = 0.1
"""Of that average [s]."""

REFUSED_NM, REFUSED_S, SLOW_RAD_S = 3.0, 0.3, 0.1
"""So much more, for so long, at so slow a joint, control asks for than may go out when its arm is not the one in the
machine: in motion a joint may need more for a while."""


class Monitors:
    """Of one machine; what it has no second signal for it does not watch."""

    def __init__(self, joints: int, period_s: float, gain: Sequence[float] | None = None):
        """Nothing has been seen yet.

        Args:
            joints: How many.
            period_s: Between two measurements [s].
            gain: Torque per motor current, as calibrated [N·m/A]; None where torque is measured by sensors.
        """
        self._joints, self._by_current = range(joints), gain is not None
        self._gain = [1.0] * joints if gain is None else gain
        times = (LATELY_MS, SLOWEST_MS, IN_A_ROW_MS, SPEED_MS, STILL_MS)
        self._lately, self._slowest, self._in_a_row, speed, self._still_most = (ticks_of(ms, period_s) for ms in times)
        self._told: deque[list[float]] = deque(maxlen=self._slowest)
        self._off_ticks, self._parted = [0] * joints, [0] * joints
        self._bias, self._bias_share = [0.0] * joints, period_s / (BIAS_S + period_s)
        self._refused, self._refused_ticks = [0] * joints, round(REFUSED_S / period_s)
        self._least_way = OPPOSITE_RAD_S * speed * period_s
        self._before: deque[tuple[list[float], list[float]]] = deque(maxlen=speed + 1)
        self._first = [math.nan] * joints
        self._last, self._still, self._motor_then = [math.nan] * joints, [0] * joints, [0.0] * joints
        """What each joint's encoder said last, for how many ticks more than one, and where its motor was at first."""

    def told(self, tau: list[float]) -> None:
        """What went out (joint,) [N·m]."""
        self._told.append(tau)

    def is_refused(self, asked: Sequence[float], tau: Sequence[float], v: Sequence[float]) -> bool:
        """Whether a slow joint has been asked for more than went out, by far and for long [N·m], [rad/s]."""
        for j, refused in enumerate(self._refused):
            is_much = abs(asked[j] - tau[j]) > REFUSED_NM and abs(v[j]) < SLOW_RAD_S
            self._refused[j] = refused + 1 if is_much else 0
        return max(self._refused) > self._refused_ticks

    def look(self, state: JointState, ignored: Collection[int] = ()) -> list[Finding]:
        """What a measurement that is believed otherwise gives away; joints in `ignored` are not asked."""
        found = [(StopReason.DRIVE_FAULT, j) for j in state.faulty]
        if state.q_motor is not None:
            found += self._parting(state.q.tolist(), state.q_motor.tolist())
        if len(self._told) >= self._lately:
            found += self._wrong_torques((state.current if self._by_current else state.tau).tolist())
        return [(reason, j) for reason, j in found if j not in ignored] if found else found

    def _wrong_torques(self, measured: list[float]) -> list[Finding]:
        """By sensors [N·m], or by currents [A]."""
        newest, gain, off_ticks, bias, found = self._told[-1], self._gain, self._off_ticks, self._bias, []
        for j in self._joints:
            tau = gain[j] * measured[j]
            off = tau - newest[j]
            size = abs(off)  # alone quicker to ask than all of the last ones
            is_off = size > TORQUE_OFF_NM and abs(self._off(j, tau, self._lately)) > TORQUE_OFF_NM
            off_ticks[j] = off_ticks[j] + 1 if is_off else 0
            if size > 0.5 * TORQUE_BIAS_NM:
                off = self._off(j, tau, self._slowest)
            # A torque that is no number is the ingress' to find; a joint that is not asked is to be watched again.
            if size < math.inf:
                bias[j] += self._bias_share * (off - bias[j])
            if off_ticks[j] >= self._in_a_row or abs(bias[j]) > TORQUE_BIAS_NM:
                found.append((StopReason.TORQUE_WRONG, j))
        return found

    def _off(self, joint: int, tau: float, ticks: int) -> float:
        """By how much it is off everything that the joint was told in the last ticks, not only the newest [N·m]."""
        lately = [told[joint] for told in islice(reversed(self._told), ticks)]
        return max(tau - max(lately), 0.0) + min(tau - min(lately), 0.0)

    def _parting(self, q: list[float], q_motor: list[float]) -> list[Finding]:
        """Joints whose two encoders have parted for some time: far, or in opposite directions, or one stands still."""
        self._before.append((q, q_motor))
        before, motor_before = self._before[0]
        first, parted, last, still, found = self._first, self._parted, self._last, self._still, []
        for j in self._joints:
            at, motor = q[j], q_motor[j]
            if first[j] != first[j]:  # no number: nothing has been seen yet
                first[j] = at - motor
            way, motor_way = at - before[j], motor - motor_before[j]
            is_opposite = way * motor_way < 0.0 and min(abs(way), abs(motor_way)) > self._least_way
            is_apart = is_opposite or abs(at - motor - first[j]) > AGREE_RAD
            parted[j] = parted[j] + 1 if is_apart else 0
            still[j] = still[j] + 1 if at == last[j] else 0
            if not still[j]:
                self._motor_then[j] = motor
            is_dead = still[j] >= self._still_most and abs(motor - self._motor_then[j]) > STILL_WAY_RAD
            if is_dead or parted[j] >= self._in_a_row:
                found.append((StopReason.ENCODERS_PART, j))
        self._last = q
        return found
