"""Comparison of redundant signals: a joint's encoder with its motor's, a commanded torque with the measured one.

Sources of all figures: docs/explanation/safety.md.
"""

import math
from collections import deque
from collections.abc import Collection, Sequence
from itertools import islice

from exograv.signals import JointState

from .period import ticks_of
from .stops import Finding, StopReason

AGREE_RAD = 0.035
"""Largest difference between the two encoders of a joint [rad]: 2°, far more than the compliance of a gear."""

OPPOSITE_RAD_S = 0.15
"""Speed from which on two encoders that move in opposite directions are not noise [rad/s]."""

TORQUE_OFF_NM = 3.0
"""Largest difference between a motor's torque and its recent commands [N·m]."""

LATELY_MS = 12
"""Longest delay of a command and of the motor's torque after it [ms]."""

SLOWEST_MS = 30
"""Time in which the torque of a slow motor, of 8 Hz, reaches most of its command [ms]."""

IN_A_ROW_MS = 10
"""Time after which a deviation is a fault [ms]."""

SPEED_MS = 8
"""Time over which the two speeds are computed [ms]."""

STILL_MS, STILL_WAY_RAD = 20, 0.003
"""Time without a change of any bit [ms], and way of the motor in it [rad], by which an encoder is dead.

The way is 0.15 rad/s over the time, or eight counts.
"""

TORQUE_BIAS_NM = 2.0
"""Largest average difference between a motor's torque and its command [N·m]."""

BIAS_S = 0.1
"""Time constant of that average [s]."""

REFUSED_NM, REFUSED_S, SLOW_RAD_S = 3.0, 0.3, 0.1
"""Refused torque [N·m], its duration [s], and joint speed [rad/s], by which the arm in the machine is another one.

The refused torque is what control asks for beyond what may go out. A moving joint may need more for a while, so only
slow joints are judged.
"""


class Monitors:
    """Monitors of one machine; a joint without a second signal is not watched."""

    def __init__(self, joints: int, period_s: float, gain: Sequence[float] | None = None):
        """Start monitors that have seen nothing yet.

        Args:
            joints: Number of joints.
            period_s: Time between two measurements [s].
            gain: Calibrated torque per motor current [N·m/A]; None if torque is measured by sensors.
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
        """Last encoder value of each joint, ticks without a change, and motor position at the first of them."""

    def told(self, tau: list[float]) -> None:
        """Record the torque that went out (joint,) [N·m]."""
        self._told.append(tau)

    def is_refused(self, asked: Sequence[float], tau: Sequence[float], v: Sequence[float]) -> bool:
        """Return True if a slow joint was asked for much more torque than went out, for long: [N·m], [rad/s]."""
        for j, refused in enumerate(self._refused):
            is_much = abs(asked[j] - tau[j]) > REFUSED_NM and abs(v[j]) < SLOW_RAD_S
            self._refused[j] = refused + 1 if is_much else 0
        return max(self._refused) > self._refused_ticks

    def look(self, state: JointState, ignored: Collection[int] = ()) -> list[Finding]:
        """Return the findings in a measurement that passed the ingress, without those of the joints in `ignored`."""
        found = [(StopReason.DRIVE_FAULT, j) for j in state.faulty]
        if state.q_motor is not None:
            found += self._parting(state.q.tolist(), state.q_motor.tolist())
        if len(self._told) >= self._lately:
            found += self._wrong_torques((state.current if self._by_current else state.tau).tolist())
        return [(reason, j) for reason, j in found if j not in ignored] if found else found

    def _wrong_torques(self, measured: list[float]) -> list[Finding]:
        """Joints whose measured torque is wrong; `measured` is in N·m from sensors, or in A from currents."""
        newest, gain, off_ticks, bias, found = self._told[-1], self._gain, self._off_ticks, self._bias, []
        for j in self._joints:
            tau = gain[j] * measured[j]
            off = tau - newest[j]
            size = abs(off)  # this test is quicker than the one over all recent commands
            is_off = size > TORQUE_OFF_NM and abs(self._off(j, tau, self._lately)) > TORQUE_OFF_NM
            off_ticks[j] = off_ticks[j] + 1 if is_off else 0
            if size > 0.5 * TORQUE_BIAS_NM:
                off = self._off(j, tau, self._slowest)
            # A non-finite torque is a matter of the ingress. An ignored joint must be watched again later, so its
            # average must stay finite.
            if size < math.inf:
                bias[j] += self._bias_share * (off - bias[j])
            if off_ticks[j] >= self._in_a_row or abs(bias[j]) > TORQUE_BIAS_NM:
                found.append((StopReason.TORQUE_WRONG, j))
        return found

    def _off(self, joint: int, tau: float, ticks: int) -> float:
        """Distance of a torque from the range of the last commands to the joint, not only from the newest [N·m]."""
        lately = [told[joint] for told in islice(reversed(self._told), ticks)]
        return max(tau - max(lately), 0.0) + min(tau - min(lately), 0.0)

    def _parting(self, q: list[float], q_motor: list[float]) -> list[Finding]:
        """Joints whose two encoders have disagreed for some time: in distance or direction, or one stands still."""
        self._before.append((q, q_motor))
        before, motor_before = self._before[0]
        first, parted, last, still, found = self._first, self._parted, self._last, self._still, []
        for j in self._joints:
            at, motor = q[j], q_motor[j]
            if first[j] != first[j]:  # NaN: nothing has been seen yet
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
