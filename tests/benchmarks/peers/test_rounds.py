"""Calls take turns, the clock's own time is subtracted, and a state is loaded before each turn."""

import time

import numpy as np

from peers.rounds import WARM_UP, Effort, timed
from peers.statistics import percentiles_per_s, percentiles_us
from peers.tasks.interface import Call

SLOW_S = 0.002
EFFORT = Effort(rounds=4, seconds_per_turn=0.01)


def test_calls_take_turns_and_each_begins_a_round_once():
    order: list[str] = []
    calls = {name: Call(lambda _: None, lambda name=name: order.append(name), dict) for name in ("a", "b")}
    timed(calls, lambda _: {}, EFFORT)
    turns = [name for i, name in enumerate(order) if i == 0 or order[i - 1] != name]
    # The first two turns measure how long a call takes.
    assert "".join(turns).startswith("abab")
    assert {"ab", "ba"} <= {"".join(turns)[i : i + 2] for i in range(len(turns) - 1)}


def test_each_turn_computes_the_state_of_its_round():
    loaded = []
    call = Call(lambda state: loaded.append(int(state["k"][0])), lambda: None, dict)
    timed({"a": call}, lambda turn: {"k": np.array([turn])}, EFFORT)
    assert loaded == [0, *range(EFFORT.rounds)]


def test_a_sleep_takes_as_long_as_it_does_and_nothing_takes_next_to_nothing():
    calls = {"sleep": Call(lambda _: None, lambda: time.sleep(SLOW_S), dict), "none": Call(lambda _: None, int, dict)}
    times = timed(calls, lambda _: {}, EFFORT)
    assert np.median(times["sleep"]) >= 1e9 * SLOW_S
    assert np.median(times["none"]) < 1e6
    assert len(times["none"]) > len(times["sleep"]) > WARM_UP


def test_percentiles_are_in_order_in_both_units():
    times = np.random.default_rng(0).exponential(1e4, 5000)
    us = list(percentiles_us(times).values())
    rates = list(percentiles_per_s(times, 10).values())
    assert us == sorted(us)
    assert rates == sorted(rates, reverse=True)
    assert rates[0] == 10 / (1e-6 * us[0])


def test_a_call_that_is_lost_in_the_clocks_noise_still_has_a_finite_rate():
    assert np.isfinite(percentiles_per_s(np.array([-5.0, 0.0, 3.0]), 1)["p50"])
