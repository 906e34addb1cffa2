"""State of a guard as plain numbers, which a recording keeps and a replay compares or puts back."""

import numpy as np

from exograv.errors import ConfigError

from .native import core
from .native.library import source_sum
from .record import GuardRecord, Numbers, Places
from .stops import StopReason

VERSION = source_sum()
"""Version of the guard (CRC-32 of its source). Another version may give the places of a state another meaning."""

_INPUTS = frozenset({core.Q_IN, core.CURRENT_IN, core.TAU_IN, core.Q_MOTOR_IN, core.FAULTY_IN, core.ANSWER_IN})
"""Joint fields that the caller writes in each tick; they are no part of the state."""


_INDICES = (
    (core.USED_AT, core.USED_SLOTS),
    (core.TOLD_AT, core.SLOWEST),
    (core.BEFORE_AT, core.SPEED),
)
"""Places of the newest entry of a ring, and of the setting that bounds it. A tick uses them as indices."""

_COUNTS = core.TOLD_COUNT, core.BEFORE_COUNT
"""Numbers of entries of a ring."""


def most_numbers(joints: int) -> int:
    """Return the largest size of the state of a guard with so many joints."""
    fields, slots = (core.USED - core.TORQUE_MAX) // core.JOINTS, 2 * (core.SLOTS + core.SPEED_SLOTS)
    return core.TORQUE_MAX + (fields + slots) * joints


def state_places(record: GuardRecord) -> Places:
    """Return the places of the state: settings, all that a tick leaves for the next one, and the rings in use."""
    r = record.numbers
    scalars = [*range(core.CAME), *range(core.VALID_UNTIL + 1, core.TORQUE_MAX)]
    starts = [field for field in range(core.TORQUE_MAX, core.USED, core.JOINTS) if field not in _INPUTS]
    speeds = int(r[core.SPEED]) + 1
    rings = (core.USED, r[core.USED_SLOTS]), (core.TOLD, r[core.SLOWEST]), (core.BEFORE, speeds)
    for ring, slots in (*rings, (core.MOTOR_BEFORE, speeds)):
        starts += [ring + slot * core.JOINTS for slot in range(int(slots))]
    return np.array([*scalars, *(start + j for start in starts for j in range(record.joints))])


def is_state(record: GuardRecord, numbers: Numbers) -> bool:
    """Return True if the guard has exactly this state."""
    places = state_places(record)
    return len(places) == len(numbers) and np.array_equal(record.view[places], numbers, equal_nan=True)


def put_state(record: GuardRecord, numbers: Numbers) -> None:
    """Give the guard this state, after the tick in which it was taken.

    Raises:
        ConfigError: It is the state of a guard with other settings, or no guard has it. The guard keeps its own then.
    """
    places = state_places(record)
    if len(places) != len(numbers):
        raise ConfigError(
            f"The state of a guard has {len(numbers)} numbers; the one of this machine has {len(places)}. Give the "
            "state of a guard with the same joints, period and version."
        )
    before = record.view.copy()
    record.view[places] = numbers
    is_alike = np.array_equal(record.view[: core.CAME], before[: core.CAME], equal_nan=True)
    if not (is_alike and _is_possible(record)):
        record.view[:] = before
        raise ConfigError(
            "The state is of a guard with other settings, or damaged. Give the state of a guard with the same machine, "
            "person and version."
        )


def _is_possible(record: GuardRecord) -> bool:
    """Return True if all numbers that a tick uses as indices, and the stop and the safe state, have a meaning."""
    r, misses = record.numbers, [(at + 1, core.MISSES) for at in (core.MACHINE_MISSES, core.CONTROL_MISSES)]
    bounds = [(at, r[slots] + (at == core.BEFORE_AT)) for at, slots in _INDICES] + misses
    bounds += [(at, core.SLOTS + 1) for at in _COUNTS] + [(core.STOP, len(StopReason) + 1)]
    is_whole = all(0.0 <= r[at] < most and r[at].is_integer() for at, most in bounds)
    return is_whole and r[core.SAFE_STATE] in {-1.0, 0.0, 1.0, 2.0, 3.0}
