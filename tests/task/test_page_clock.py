"""The page's clock is estimated through a network with delays, and the truth is always within the stated bound."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.task.page_clock import DRIFT_MAX, PageClock, PingTimes

OFFSET_S = 1234.5


def pinged(seed: int, drift: float = 20e-6, seconds: int = 300, queue_s: float = 0.02) -> PageClock:
    """Pings, one per second. Each direction takes at least 0.5 ms, and a random time in queues."""
    rng, clock = np.random.default_rng(seed), PageClock()
    for k in range(seconds):
        there, here = (5e-4 + rng.exponential(queue_s, 2)).tolist()
        clock = clock.with_ping(ping(float(k), drift, there, here))
    return clock


def ping(asked: float, drift: float, there_s: float, here_s: float) -> PingTimes:
    heard = asked * (1.0 + drift) + OFFSET_S + there_s
    answered = heard + 1e-4
    return PingTimes(asked, heard, answered, (answered + here_s - OFFSET_S) / (1.0 + drift))


@settings(max_examples=40)
@given(seed=st.integers(1000, 2000), drift=st.floats(-200e-6, 200e-6), t=st.floats(-50.0, 350.0))
def test_the_truth_is_within_the_bound(seed: int, drift: float, t: float):
    placed = pinged(seed, drift, seconds=40).to_server(t)
    assert placed is not None
    assert abs(placed.t - (t * (1.0 + drift) + OFFSET_S)) <= placed.bound_s + 1e-9


def test_after_five_minutes_of_a_busy_network_half_of_all_clocks_are_known_to_two_milliseconds():
    placed = [pinged(seed).to_server(280.0) for seed in range(1000, 1021)]
    errors = [one.t - (280.0 * (1.0 + 20e-6) + OFFSET_S) for one in placed if one is not None]
    assert np.median(np.abs(errors)) < 2e-3


def test_a_way_that_is_longer_on_one_side_is_wrong_by_no_more_than_the_bound_says():
    clock = PageClock().with_ping(ping(0.0, 0.0, 0.08, 0.001))
    placed = clock.to_server(0.0)
    assert placed is not None
    assert abs(placed.t - OFFSET_S) == pytest.approx(0.0395, abs=1e-6)
    assert placed.bound_s == pytest.approx(0.0405, abs=1e-3)


def test_a_clock_that_jumps_is_measured_anew():
    clock = pinged(1000, seconds=30)
    asleep = PingTimes(30.0, 30.0 + OFFSET_S + 60.0, 30.0 + OFFSET_S + 60.0, 30.001)
    again = clock.with_ping(asleep)
    assert (clock.jumps, again.jumps) == (0, 1)
    placed = again.to_server(31.0)
    assert placed is not None
    assert placed.t == pytest.approx(31.0 + OFFSET_S + 60.0, abs=0.001 + DRIFT_MAX)


@pytest.mark.parametrize(
    "impossible",
    [(0.0, 1.0, 1.0, -1.0), (0.0, 2.0, 1.0, 3.0), (0.0, 1.0, 9.0, 0.1), (0.0, float("nan"), 1.0, 1.0), (0.0, 1, 1, 99)],
)
def test_four_numbers_that_are_no_ping_change_nothing(impossible: tuple[float, float, float, float]):
    clock = pinged(1000, seconds=10)
    assert clock.with_ping(PingTimes(*impossible)) is clock


def test_nothing_is_known_before_the_first_ping():
    assert PageClock().to_server(0.0) is None


def test_the_estimate_is_within_what_the_quickest_ping_allows():
    clock = PageClock()
    for k in range(20):
        clock = clock.with_ping(ping(6.0 * k, 0.0, 0.08, 0.001))
    quick = ping(120.0, 0.0, 0.0005, 0.0005)
    placed = clock.with_ping(quick).to_server(120.0)
    assert placed is not None
    assert abs(placed.t - (120.0 + OFFSET_S)) <= quick.half_way_s + DRIFT_MAX
