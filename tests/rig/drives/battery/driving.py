"""A loop at the rig's own period, as short as one can be, and what the drives did by their own account."""

import re
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from exograv.rig.drives.settings import Drives
from exograv.signals import Command, JointState

LIFE_S = 0.02
CURRENT = 0.3
"""So little that friction holds the machine where it hangs [A]."""

LATE_MS = 2.0
"""A watchdog is seen in the first step after it: one period of the loop, one of the device."""

UNSAID = {"moteus": {"rated current"}}
"""Of a nameplate, what drives on a bus do not say."""

HOSTS = ("has the controller", "a host reads the settings")
WATCHDOG = re.compile(r"([\d.]+) s: (\w+): WATCHDOG; told last ([\d.]+) ms before")


def told(rig: Any, state: JointState, current: Any = 0.0, damping: float = 0.0, life_s: float = LIFE_S) -> Command:
    """So much of each joint [A], or of every one."""
    n, t = len(rig.joints), rig.t
    return Command(t, state.sequence, t + life_s, np.zeros(n), np.full(n, 0.0) + current, np.full(n, damping))


def drive(
    rig: Any, seconds: float, current: Any = 0.0, until: Callable[[JointState], bool] = lambda state: False
) -> JointState:
    """Read and write in so many periods as these are seconds, or until something is seen."""
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
    """Which drives are on, by their own account."""
    return [joint["enabled"] for joint in bench.report().values()]


def currents(bench: Any) -> list[float]:
    """What flows in each motor [A]."""
    return [joint["current_A"] for joint in bench.report().values()]


def brakes(bench: Any, drives: Drives) -> bool:
    """Whether every drive gives no torque and damps as its nameplate says."""
    return [(one["current_A"], one["damping"]) for one in bench.report().values()] == [
        (0.0, one.brake_Nms_per_rad) for one in drives.each
    ]


def watchdogs(bench: Any, drives: Drives) -> dict[str, float]:
    """After how long each drive's watchdog ended its torque, since the last host came [ms]."""
    while True:
        hosts = [k for k, line in enumerate(bench.seen) if any(host in line for host in HOSTS)]
        matches = [match for line in bench.seen[max(hosts, default=0) :] if (match := WATCHDOG.match(line))]
        found = {match[2]: float(match[3]) for match in matches}
        if set(found) == set(drives.joints):
            return found
        bench.line(lambda line: WATCHDOG.match(line) is not None)
