"""Short loop at the rig's own period, and the actions of the drives by their own report."""

import re
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from exograv.rig.drives.settings import Drives
from exograv.signals import Command, JointState

LIFE_S = 0.02
CURRENT = 0.3
"""Current so small that friction holds the machine in its hanging posture [A]."""

LATE_MS = 2.0
"""Largest lateness of a watchdog's report [ms]: one period of the loop and one of the device."""

WATCHDOG = re.compile(r"([\d.]+) s: (\w+): WATCHDOG; last command ([\d.]+) ms before")


def told(rig: Any, state: JointState, current: Any = 0.0, damping: float = 0.0, life_s: float = LIFE_S) -> Command:
    """Command with the same current for every joint, or a current per joint [A]."""
    n, t = len(rig.joints), rig.t
    return Command(t, state.sequence, t + life_s, np.zeros(n), np.full(n, 0.0) + current, np.full(n, damping))


def drive(
    rig: Any, seconds: float, current: Any = 0.0, until: Callable[[JointState], bool] = lambda state: False
) -> JointState:
    """Read and write for `seconds`, counted in periods, or until a condition holds."""
    due = time.monotonic()
    state = rig.read()
    for _ in range(round(seconds / rig.period_s)):
        rig.write(told(rig, state, current))
        due = max(due + rig.period_s, time.monotonic() - 0.01)
        time.sleep(max(due - time.monotonic(), 0.0))
        state = rig.read()
        if until(state):
            break
    return state


def are_on(bench: Any) -> list[bool]:
    """Return which drives are on, by their own report."""
    return [joint["enabled"] for joint in bench.report().values()]


def currents(bench: Any) -> list[float]:
    """Return the current in each motor, in its drive's direction [A]."""
    return [joint["current_A"] for joint in bench.report().values()]


def brakes(bench: Any, drives: Drives) -> bool:
    """Return True if every drive gives no torque and damps as its nameplate says."""
    return [(one["current_A"], one["damping"]) for one in bench.report().values()] == [
        (0.0, one.brake_Nms_per_rad) for one in drives.each
    ]


def watchdogs(bench: Any, drives: Drives) -> dict[str, float]:
    """Return the time after which each drive's watchdog ended its torque, since the bench was reset [ms]."""
    while True:
        found = {match[2]: float(match[3]) for line in bench.seen if (match := WATCHDOG.match(line))}
        if set(found) == set(drives.joints):
            return found
        bench.line(lambda line: WATCHDOG.match(line) is not None)
