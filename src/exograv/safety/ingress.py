"""Checks of each measurement before it is used: finite values, order, age, jumps and dead encoders.

`native/core.py` has the checks; this file has their times and what a caller gives and gets.
Sources of all figures: docs/explanation/safety.md.
"""

import math
from collections.abc import Collection, Sequence
from typing import NamedTuple

import numpy as np

from exograv.errors import ConfigError
from exograv.signals import JointState, TorqueSource

from .native import core
from .period import ticks_of
from .record import GuardRecord, places
from .stops import Finding, StopReason

JUMP_SHARE = 1.5
"""Limit of a position jump, as a multiple of the way of the fastest joint in one tick [-]."""

FROZEN_MS = 20
"""Time after which an encoder counts as failed, if no bit of its value changes after a motion [ms].

A joint never comes to rest like that.
"""

FROZEN_FROM_RAD_S = 0.2
"""Speed above which an encoder whose value does not change has certainly failed [rad/s]."""

MOVING_MS, MOVING_COUNTS = 5, 4
"""Time just before the freeze [ms] in which the joint was that fast, and encoder counts that it moved.

From such a motion a joint cannot come to rest within one count. That would take a braking of more than 50 rad/s², and
no motor brakes an arm so hard.
"""

KEPT_MS, KEPT_JOINT_MS = 40, 80
"""Time after which a machine, and a single joint, counts as a frozen image if no signal has changed a bit [ms].

Only signals with noise are judged, and only if intact ones would keep their bits so long with a chance of 1e-10.
"""

NOISE_S = 1.0
"""Time constant of the shares from which that chance is computed [s]."""

COARSEST_COUNT_RAD = 2.0 * math.pi / 2**13
"""Encoder count of a machine that does not state its own [rad].

It is the coarsest of the machines that we know.
"""

_SCALARS = [core.WAY, core.MOVING, core.USED_SLOTS, core.SEQUENCE, core.T_USED, core.DROPPED, core.USABLE, core.USED_AT]
_SCALARS += [core.FROZEN_MOST, core.FROZEN_JOINT, core.NOISE_STEP]
_FIELDS = [core.REACH, core.SLACK, core.LEAST_WAY, core.IGNORED, core.JUMPS]
_FIELDS += range(core.KEPT_TICKS, core.USED, core.JOINTS)
_RING = range(core.USED, core.TOLD)
PLACES = np.array([*_SCALARS, *places(_FIELDS), *_RING])
"""Places of the record that belong to the ingress."""


class IngressResult(NamedTuple):
    """Result of the check in one tick."""

    state: JointState | None
    """Measurement that may be used; None if there is none."""

    found: tuple[Finding, ...] = ()
    """Joints whose encoder is certainly wrong, with the reason."""

    broken: frozenset[int] = frozenset()
    """Joints with a non-finite value."""


class Ingress:
    """Check of one machine's measurements, with the past values that it needs."""

    def __init__(self, counts_rad: Sequence[float], period_s: float, v_trip_rad_s: float):
        """Start a check that has seen no measurement yet.

        Args:
            counts_rad: Resolution of each joint's encoder [rad]; infinite if the joint is not watched.
            period_s: Time between two measurements [s].
            v_trip_rad_s: Largest allowed joint speed, as in the envelope [rad/s].

        Raises:
            ConfigError: A count is negative or NaN, or the period is too short.
        """
        for j, count in enumerate(counts_rad):
            if not count >= 0.0:
                raise ConfigError(
                    f"The encoder of joint {j} has a count of {count} rad; allowed: 0 and above, infinite where it is "
                    "not watched. Correct it in the rig file."
                )
        way, counts = v_trip_rad_s * period_s, np.array(counts_rad, dtype=float)
        moving, frozen = ticks_of(MOVING_MS, period_s), ticks_of(FROZEN_MS, period_s)
        if moving + frozen + 1 > core.SLOTS:
            least_s = (MOVING_MS + FROZEN_MS) / (1e3 * (core.SLOTS - 1))
            raise ConfigError(f"The period is {period_s} s; the guard needs at least {least_s:.6f} s.")
        self.record = record = GuardRecord(len(counts), period_s)
        r = record.numbers
        r[core.WAY], r[core.MOVING], r[core.USED_SLOTS] = way, moving, moving + frozen + 1
        record.put(core.REACH, JUMP_SHARE * way + counts)
        record.put(core.SLACK, (JUMP_SHARE - 1.0) * way + counts)
        clear = FROZEN_FROM_RAD_S * moving * period_s
        record.put(core.LEAST_WAY, np.maximum(clear, MOVING_COUNTS * counts))
        is_watched = all(map(math.isfinite, counts_rad))
        r[core.FROZEN_MOST] = ticks_of(KEPT_MS, period_s) if is_watched else math.inf
        r[core.FROZEN_JOINT] = ticks_of(KEPT_JOINT_MS, period_s) if is_watched else math.inf
        r[core.NOISE_STEP] = period_s / (NOISE_S + period_s)
        record.put(core.KEPT_SHARE, 1.0)
        record.put(core.KEPT_CHANCE, 1.0)
        for field in (core.Q_KEPT, core.MOTOR_KEPT, core.TORQUE_KEPT):
            record.put(field, np.nan)
        # Comparisons with NaN are false, so values that were not seen yet raise no finding.
        record.view[_RING] = np.nan

    @property
    def dropped(self) -> int:
        """Count of measurements that came twice or after a newer one; they are never used."""
        return int(self.record.numbers[core.DROPPED])

    def see(self, state: JointState | None, now: float, ignored: Collection[int] = ()) -> IngressResult:
        """Check the measurement of one tick, alone.

        Args:
            state: Measurement that came; None if nothing came.
            now: Time on the rig's clock [s].
            ignored: Isolated joints; their values do not spoil a measurement.
        """
        record = self.record
        for j in range(record.joints):
            record.numbers[core.ISOLATED + j] = float(j in ignored)
        put_measurement(record, state, now)
        core.take_in(record.numbers)
        found = [(StopReason.ENCODER_JUMPED, j) for j in sorted(record.joints_at(core.JUMPED))]
        found += [(StopReason.ENCODER_DEAD, j) for j in sorted(record.joints_at(core.DEAD))]
        is_usable = record.numbers[core.USABLE] != 0.0
        return IngressResult(state if is_usable else None, tuple(found), record.joints_at(core.BROKEN))


_BY_CURRENT = TorqueSource.CURRENT  # the look-up of an enum member takes as long as the check of a joint


def put_measurement(record: GuardRecord, state: JointState | None, now: float) -> None:
    """Write the measurement of a tick into the record."""
    r = record.numbers
    r[core.NOW] = now
    if state is None:
        r[core.CAME] = 0.0
        return
    r[core.CAME], r[core.SEQUENCE_IN], r[core.T_IN] = 1.0, state.sequence, state.t
    r[core.IN_CURRENT] = 1.0 if state.torque_source is _BY_CURRENT else 0.0
    record.q_in[:] = state.q
    record.current_in[:] = state.current
    record.tau_in[:] = state.tau
    if state.q_motor is None:
        r[core.HAS_MOTOR] = 0.0
    else:
        r[core.HAS_MOTOR] = 1.0
        record.q_motor_in[:] = state.q_motor
    record.put_faulty(state.faulty)
