"""The loop keeps its phase, repeats no period, and never blocks a processor."""

import time
from collections.abc import Callable

import numpy as np
import pytest

from exograv.runtime.clock.real_time_loop import REST_AT_LEAST_EVERY, SPIN_NS, run_loop
from exograv.runtime.clock.timing import LoopOutcome, Timing

PERIOD_NS = 1_000_000
READ_NS = 500
"""Time of one look at the clock; a busy wait meets its deadline within this [ns]."""


class Clock:
    """Clock that advances only by a look, sleep or work."""

    def __init__(self):
        self.now = 5_000_000_000
        self.slept: list[float] = []
        self.periods: list[int] = []

    def now_ns(self) -> int:
        self.now += READ_NS
        return self.now

    def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)
        self.now += round(1e9 * seconds)

    def run(self, periods: int, cost_ns: Callable[[int], int], is_awaited: bool = False) -> Timing:
        """Run the loop on this clock, with a tick that takes `cost_ns` in a period."""

        def work(period: int) -> None:
            self.periods.append(period)
            self.now += cost_ns(period)

        return run_loop(work, periods, PERIOD_NS, self.now_ns, self.sleep, is_awaited=is_awaited)


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_deadlines_do_not_drift_however_long_the_ticks_are(clock: Clock):
    timing = clock.run(1000, lambda period: 100_000 + 700_000 * (period % 2))
    assert clock.periods == list(range(1000))
    assert timing.lateness_ns.max() <= READ_NS
    assert timing.effective_rate_Hz == pytest.approx(1000.0)
    assert timing.outcome is LoopOutcome.COMPLETE


def test_the_duration_of_a_tick_is_separate_from_its_lateness(clock: Clock):
    timing = clock.run(10, lambda _period: 300_000)
    assert np.all(np.abs(timing.compute_ns - 300_000) <= READ_NS)


def test_a_late_tick_starts_at_once_and_the_next_is_on_time(clock: Clock):
    timing = clock.run(10, lambda period: 1_400_000 if period == 3 else 100_000)
    assert timing.lateness_ns[4] == pytest.approx(400_000, abs=3 * READ_NS)
    assert timing.lateness_ns[5] <= READ_NS
    assert timing.missed == 1


def test_periods_that_are_over_are_skipped_and_never_repeated(clock: Clock):
    timing = clock.run(200, lambda period: 83_200_000 if period == 10 else 100_000)
    assert clock.periods[:13] == [*range(11), 93, 94]
    assert timing.periods == 200
    assert timing.missed == 83
    assert timing.longest_gap_us == pytest.approx(84_100.0, abs=10.0)  # a period and the stall, less a tick


def test_for_a_machine_that_waits_no_period_is_skipped_and_all_deadlines_move_by_the_stall(clock: Clock):
    timing = clock.run(200, lambda period: 83_200_000 if period == 10 else 100_000, is_awaited=True)
    assert clock.periods == list(range(200))
    assert timing.period.tolist() == list(range(200))
    assert timing.waited_ns == pytest.approx(82_200_000, abs=3 * READ_NS)
    assert timing.lateness_ns.max() <= 3 * READ_NS


def test_for_a_machine_that_waits_a_loop_that_never_sleeps_goes_on(clock: Clock):
    timing = clock.run(5 * REST_AT_LEAST_EVERY, lambda _period: 2 * PERIOD_NS, is_awaited=True)
    assert timing.outcome is LoopOutcome.COMPLETE
    assert timing.waited_ns == pytest.approx(5 * REST_AT_LEAST_EVERY * PERIOD_NS, rel=0.01)


def test_a_stall_at_the_end_counts_all_the_periods_it_took(clock: Clock):
    timing = clock.run(10, lambda period: 5_500_000 if period == 9 else 100_000)
    assert timing.periods == 14
    assert timing.missed == 5


def test_a_tick_that_never_leaves_time_to_sleep_ends_the_loop(clock: Clock):
    timing = clock.run(100_000, lambda _period: PERIOD_NS + 1)
    assert timing.outcome is LoopOutcome.NO_REST
    assert len(clock.periods) <= REST_AT_LEAST_EVERY + 1


def test_a_tick_that_leaves_a_little_time_to_sleep_goes_on(clock: Clock):
    timing = clock.run(1000, lambda _period: PERIOD_NS - SPIN_NS - 20_000)
    assert timing.outcome is LoopOutcome.COMPLETE
    assert timing.missed == 0


def test_sleep_ends_before_the_deadline_by_the_time_of_the_busy_wait(clock: Clock):
    clock.run(5, lambda _period: 100_000)
    assert clock.slept[1] == pytest.approx(1e-9 * (PERIOD_NS - SPIN_NS - 100_000), abs=3e-9 * READ_NS)


def test_a_sleep_that_ends_early_is_continued(clock: Clock):
    whole = clock.sleep
    clock.sleep = lambda seconds: whole(0.5 * seconds if seconds > 1e-4 else seconds)
    assert clock.run(20, lambda _period: 100_000).lateness_ns.max() <= READ_NS


def test_an_error_of_a_tick_is_not_hidden(clock: Clock):
    def break_off(_period: int) -> int:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        clock.run(5, break_off)


def test_a_tick_that_returns_true_ends_the_loop_early(clock: Clock):
    def work(period: int) -> bool:
        clock.periods.append(period)
        return period == 4

    timing = run_loop(work, 100, PERIOD_NS, clock.now_ns, clock.sleep)
    assert clock.periods == [0, 1, 2, 3, 4]
    assert timing.periods == 5
    assert timing.outcome is LoopOutcome.ENDED_EARLY


def test_the_first_tick_follows_the_beginning_within_a_drives_watchdog_however_long_the_run_is(clock: Clock):
    begun = list[int]()
    hours = 4 * 3600 * 1000

    def tick(_period: int) -> bool:
        begun.append(time.monotonic_ns())
        return True

    # The real clock: what has to be short is the filling of memory, which a simulated clock does not see.
    run_loop(tick, hours, PERIOD_NS, begin=lambda: begun.append(time.monotonic_ns()))
    assert begun[1] - begun[0] < 20 * PERIOD_NS
