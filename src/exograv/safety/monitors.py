"""Comparison of redundant signals: a joint's encoder with its motor's, a commanded torque with the measured one.

`native/core.py` has the comparison; this file has its times. Sources of all figures: docs/explanation/safety.md.
"""

from collections.abc import Sequence

import numpy as np

from exograv.errors import ConfigError

from .native import core
from .period import ticks_of
from .record import GuardRecord

OPPOSITE_RAD_S = 0.15
"""Speed from which on two encoders that move in opposite directions are not noise [rad/s]."""

LATELY_MS = 12
"""Longest delay of a command and of the motor's torque after it [ms]."""

SLOWEST_MS = 30
"""Time in which the torque of a slow motor, of 8 Hz, reaches most of its command [ms]."""

IN_A_ROW_MS = 10
"""Time after which a deviation is a fault [ms]."""

SPEED_MS = 8
"""Time over which the two speeds are computed [ms]."""

STILL_MS = 20
"""Time after which an encoder counts as failed [ms], if none of its bits changes while its motor moves `STILL_WAY_RAD`.

That way is 0.15 rad/s over the time, or eight counts.
"""

BIAS_S = 0.1
"""Time constant of the average difference between a motor's torque and its command [s]."""

REFUSED_S = 0.3
"""Duration of a refused torque [s] by which the arm in the machine is another one.

The refused torque is what control asks for beyond what may go out. A moving joint may need more for a while, so only
slow joints are judged.
"""


def set_monitors(record: GuardRecord, gain: Sequence[float] | None, compares: bool) -> None:
    """Write the settings of the monitors.

    Args:
        record: Record of the machine.
        gain: Calibrated torque per motor current (joint,) [N·m/A]; None if torque is measured by sensors.
        compares: True to compare redundant signals.

    Raises:
        ConfigError: The period is too short.
    """
    r = record.numbers
    period_s = r[core.DT]
    if ticks_of(SLOWEST_MS, period_s) > core.SLOTS or ticks_of(SPEED_MS, period_s) >= core.SPEED_SLOTS:
        raise ConfigError(f"The period is {period_s} s; the guard needs at least 0.00025 s.")
    r[core.COMPARES], r[core.BY_GAIN] = float(compares), float(gain is not None)
    for place, ms in (
        (core.LATELY, LATELY_MS),
        (core.SLOWEST, SLOWEST_MS),
        (core.IN_A_ROW, IN_A_ROW_MS),
        (core.SPEED, SPEED_MS),
        (core.STILL_MOST, STILL_MS),
    ):
        r[place] = ticks_of(ms, period_s)
    r[core.BEFORE_AT] = r[core.SPEED]  # the first position goes to the first place of the ring
    r[core.TOLD_AT] = r[core.SLOWEST] - 1.0
    r[core.BIAS_SHARE] = period_s / (BIAS_S + period_s)
    r[core.REFUSED_MOST] = round(REFUSED_S / period_s)
    r[core.LEAST_OPPOSITE] = OPPOSITE_RAD_S * r[core.SPEED] * period_s
    record.put(core.GAIN, 1.0 if gain is None else np.array(gain, dtype=float))
