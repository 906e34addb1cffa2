"""The figures of a loop are true: late ticks are counted as late, and the histogram has all ticks."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.runtime.clock.timing import EDGES_US, LATE_NS, PERIOD_NS, LoopOutcome, Timing


def timing(lateness_us: list[int], compute_us: int = 50, periods: int | None = None) -> Timing:
    """Return a timing with one tick in each of the first periods."""
    lateness = 1000 * np.array(lateness_us, dtype=np.int64)
    ticks = np.arange(len(lateness))
    count = len(lateness) if periods is None else periods
    return Timing(ticks, lateness, np.full_like(lateness, 1000 * compute_us), count, PERIOD_NS, LoopOutcome.COMPLETE)


def test_a_punctual_loop_misses_nothing_and_keeps_its_rate():
    found = timing([0] * 100)
    assert (found.missed, found.late_share) == (0, 0.0)
    assert found.effective_rate_Hz == pytest.approx(1000.0)
    assert found.longest_gap_us == pytest.approx(1000.0)


def test_lateness_counts_the_command_and_not_the_start():
    found = timing([0, 460, 0, 0], compute_us=50)
    assert found.lateness_ns.max() < LATE_NS
    assert found.late_share == 0.25


def test_a_command_after_its_period_is_missed_although_it_came():
    assert timing([0, 960, 0]).missed == 1


def test_a_period_without_a_tick_is_missed_and_lowers_the_rate():
    found = timing([0] * 9, periods=10)
    assert found.missed == 1
    assert found.effective_rate_Hz == pytest.approx(900.0)
    assert found.woken_within(200_000) == pytest.approx(0.9)


def test_the_longest_gap_is_between_commands():
    assert timing([0, 700, 0]).longest_gap_us == pytest.approx(1700.0)


def test_one_tick_has_no_gap_longer_than_its_period():
    assert timing([0]).longest_gap_us == pytest.approx(1000.0)


@given(st.lists(st.integers(0, 10**8), min_size=1, max_size=50))
def test_every_tick_is_in_the_histogram_however_late(lateness_us: list[int]):
    assert sum(timing(lateness_us).histogram()) == len(lateness_us)


def test_the_criteria_are_edges_of_the_bins():
    counts = dict(zip(EDGES_US[1:], timing([199, 200, 999, 1000]).histogram(), strict=True))
    assert (counts[200], counts[500], counts[1000], counts[2000]) == (1, 1, 1, 1)
