"""Periodic loop of a live run, with deadlines that do not drift and a record of the times of each call."""

import time
from collections.abc import Callable

import numpy as np

from .timing import PERIOD_NS, LoopOutcome, Timing

SPIN_NS = 100_000
"""Last time before a deadline that is spent awake [ns].

To wake a sleeping processor takes 30 to 80 µs, and varies. The busy wait costs up to a tenth of one processor. Its gain
is in docs/explanation/realtime.md. With a longer one, another loop at the same priority would wait for a loop that only
reads the clock.
"""

REST_AT_LEAST_EVERY = 100
"""Number of ticks in a row without sleep after which the loop gives up.

Under SCHED_FIFO nothing else runs on that processor meanwhile. A tenth of a second is more than a single pause needs to
catch up (skipped periods are not repeated), and less than a person at the keyboard notices.
"""

LEAD_NS = 2 * PERIOD_NS  # the first deadline lies after the set-up that follows


def run_loop(
    work: Callable[[int], object],
    periods: int,
    period_ns: int = PERIOD_NS,
    now_ns: Callable[[], int] = time.monotonic_ns,
    sleep: Callable[[float], object] = time.sleep,
    spin_ns: int = SPIN_NS,
    begin: Callable[[], object] = lambda: None,
    is_awaited: bool = False,
) -> Timing:
    """Call `work` once a period with the number of the period, for `periods` periods.

    A deadline is a multiple of the period after the start, independent of earlier ticks. A late tick starts at once. A
    period that is over is skipped, not repeated: a torque for a past posture is of no use, and a burst is worse.

    Args:
        work: Function of a tick. It must not raise in the ordinary course, block or log, or allocate memory that it can
            hold. A true result ends the loop.
        periods: Number of periods.
        period_ns: Length of a period [ns].
        now_ns: Monotonic clock [ns].
        sleep: Sleep function [s]; `time.sleep` uses `clock_nanosleep` to an absolute time since Python 3.11.
        spin_ns: Time before a deadline at which sleep ends and the busy wait begins [ns].
        begin: Function that is called once, just before the first tick, such as to switch motors on.
        is_awaited: True if the machine waits for this loop. Then no period is skipped: after a late tick all deadlines
            move, and the loop has no limit of ticks without sleep.
    """
    # The arrays are filled, not empty, so that each page is touched before the first deadline.
    period_of, lateness, compute = (np.full(periods, -1, dtype=np.int64) for _ in range(3))
    # For two hours at 1 ms this takes 0.1 s: longer than the watchdogs of drives that are on.
    begin()
    start = now_ns() + LEAD_NS
    tick = period = restless = waited = 0
    is_last = False
    while period < periods and restless < REST_AT_LEAST_EVERY:
        deadline = start + period * period_ns
        restless += not is_awaited
        woken = now_ns()
        while (ahead := deadline - spin_ns - woken) > 0:
            sleep(1e-9 * ahead)
            woken = now_ns()
            restless = 0
        while woken < deadline:
            woken = now_ns()
        is_last = bool(work(period))
        done = now_ns()
        period_of[tick], lateness[tick], compute[tick] = period, woken - deadline, done - woken
        tick += 1
        if is_awaited:
            period += 1
            behind = max(done - start - period * period_ns, 0)
            start, waited = start + behind, waited + behind
        else:
            period = max(period + 1, (done - start) // period_ns)
        if is_last:
            break
    if period >= periods:
        outcome = LoopOutcome.COMPLETE
    else:
        outcome = LoopOutcome.ENDED_EARLY if is_last else LoopOutcome.NO_REST
    waited_ns = waited if is_awaited else None
    return Timing(period_of[:tick], lateness[:tick], compute[:tick], period, period_ns, outcome, waited_ns)
