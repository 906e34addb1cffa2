"""Bare loops beside a flight, one on each processor: they show the pauses of the computer itself."""

import contextlib
import json
import os
import select
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator
from typing import NamedTuple

from exograv.laboratory.simulated_drives.drive_sim import DRIVES_PRIORITY
from exograv.runtime.clock.realtime import realtime

PRIORITY = DRIVES_PRIORITY + 5
"""Priority of the bare loops. No process of a session can delay them."""

TICK_S, LATE_S = 1e-3, 0.5e-3
"""Period of a bare loop, and lateness that is noted [s]."""

READY = "ready"
LOOK_TICKS, END_S = 100, 5.0
"""Number of ticks between two looks at the input, and time in which a bare loop ends [s]."""


class HostPause(NamedTuple):
    """Late wake-up of a bare loop."""

    end_t: float
    """End of the pause on CLOCK_MONOTONIC [s]."""
    late_s: float
    cpu: int


@contextlib.contextmanager
def bare_loops() -> Iterator[list[HostPause] | None]:
    """Run a bare loop on each processor; at the end the list has the pauses.

    None if a loop did not get real-time priority: then it shows nothing.
    """
    pauses = list[HostPause]()
    pipe = subprocess.PIPE
    with contextlib.ExitStack() as stack:
        loops = [
            stack.enter_context(
                subprocess.Popen(
                    [sys.executable, "-m", __name__, str(cpu)], stdin=pipe, stdout=pipe, text=True, process_group=0
                )
            )
            for cpu in sorted(os.sched_getaffinity(0))
        ]
        try:
            is_ready = [(loop.stdout or sys.stdin).readline().strip() == READY for loop in loops]
            yield pauses if all(is_ready) else None
        finally:
            for loop in loops:
                try:
                    pauses += [HostPause(*row) for row in json.loads(loop.communicate("end\n", END_S)[0] or "[]")]
                except (subprocess.TimeoutExpired, ValueError):
                    loop.kill()


def paused_s(pauses: Iterable[HostPause], begin_t: float, end_t: float) -> float:
    """Sum of the pauses between two times, of the processor that paused longest [s]."""
    by_cpu = dict[int, float]()
    for one in pauses:
        if begin_t <= one.end_t and one.end_t - one.late_s <= end_t:
            by_cpu[one.cpu] = by_cpu.get(one.cpu, 0.0) + one.late_s
    return max(by_cpu.values(), default=0.0)


def main(cpu: str) -> None:
    """Sleep once per millisecond until the input has a line or ends, then print the pauses."""
    pauses = list[HostPause]()
    with realtime(int(cpu), PRIORITY) as rights:
        print(READY if rights.is_fifo else "no real-time priority", flush=True)
        ticks, due = 0, time.monotonic()
        while ticks % LOOK_TICKS or not select.select([sys.stdin], [], [], 0.0)[0]:
            ticks, due = ticks + 1, due + TICK_S
            time.sleep(max(due - time.monotonic(), 0.0))
            now = time.monotonic()
            if now - due > LATE_S:
                pauses.append(HostPause(now, now - due, int(cpu)))
                due = now
    print(json.dumps(pauses))


if __name__ == "__main__":
    main(*sys.argv[1:])
