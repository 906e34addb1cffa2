"""Decimated rows represent all ticks: no aliasing, no delay, and no value across a gap."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.study.bids.decimation import FILL_MAX_S, Decimation, DecimationReport

RATE_HZ = 1000.0
STEP = 10
ROUNDING = 1e-9
FILTER_ERROR = 0.007
"""Properties of the filter as stated by `decimation.CUTOFF`."""


def decimated(
    t: np.ndarray, values: np.ndarray, sequence: np.ndarray | None = None, step: int = STEP, cuts: tuple[int, ...] = ()
) -> tuple[np.ndarray, np.ndarray, np.ndarray, DecimationReport]:
    """Return times, filtered and plain values of the rows; ticks are fed in pieces that end at `cuts`."""
    decimation = Decimation(step, RATE_HZ)
    sequence = np.zeros(len(t), int) if sequence is None else sequence
    edges = [0, *sorted(cuts), len(t)]
    blocks = []
    for a, b in pairwise(edges):
        blocks += decimation.feed(t[a:b], sequence[a:b], values[a:b, None], values[a:b, None])
    blocks += decimation.end()
    parts = [(block.t, block.filtered[:, 0], block.plain[:, 0]) for block in blocks]
    rows, filtered, plain = (np.concatenate(column) for column in zip(*parts, strict=True))
    return rows, filtered, plain, decimation.account


def clock(n: int) -> np.ndarray:
    return 3.0 + np.arange(n) / RATE_HZ


def test_a_straight_line_stays_the_same_to_its_ends():
    t = clock(2000)
    rows, filtered, plain, account = decimated(t, 2.0 * t - 1.0)
    assert np.allclose(rows, t[::STEP], atol=ROUNDING)
    assert np.allclose(filtered, 2.0 * rows - 1.0, atol=ROUNDING)
    assert np.array_equal(plain, (2.0 * t - 1.0)[::STEP])
    assert (account.ticks, account.rows, account.missing) == (2000, 200, 0)


@pytest.mark.parametrize("hertz", [0.5, 5.0, 20.0, 29.0])
def test_a_movement_passes_without_delay(hertz: float):
    t = clock(5000)
    rows, filtered, _, _ = decimated(t, np.sin(2 * np.pi * hertz * t))
    inside = slice(10, -10)
    assert np.allclose(filtered[inside], np.sin(2 * np.pi * hertz * rows[inside]), atol=FILTER_ERROR)


@pytest.mark.parametrize("hertz", [51.0, 93.0, 100.0, 203.0, 499.0])
def test_what_is_too_fast_for_the_rows_does_not_fold_back(hertz: float):
    t = clock(5000)
    _, filtered, plain, _ = decimated(t, np.cos(2 * np.pi * hertz * t))
    assert np.abs(filtered[10:-10]).max() < FILTER_ERROR
    assert np.abs(plain[10:-10]).max() > 0.5


def test_every_tick_is_a_row_where_as_many_are_wanted():
    t = clock(50)
    values = np.random.default_rng(1000).standard_normal(50)
    rows, filtered, _, _ = decimated(t, values, step=1)
    assert np.array_equal(rows, t)
    assert np.allclose(filtered, values, atol=ROUNDING)


@settings(max_examples=60, deadline=None)
@given(
    cuts=st.lists(st.integers(0, 900), max_size=12),
    lost=st.lists(st.tuples(st.integers(1, 880), st.integers(1, 60)), max_size=4),
    step=st.sampled_from([1, 4, 10]),
)
def test_it_does_not_matter_in_which_pieces_ticks_come(cuts: list[int], lost: list[tuple[int, int]], step: int):
    t, kept = clock(900), np.ones(900, bool)
    for first, count in lost:
        kept[first : first + count] = False
    values = np.sin(9.0 * t) + np.random.default_rng(1001).standard_normal(900)
    ticks = t[kept], values[kept], np.arange(1, 901)[kept]
    whole = decimated(*ticks, step=step)
    pieces = decimated(*ticks, step=step, cuts=tuple(min(cut, int(kept.sum())) for cut in cuts))
    for a, b in zip(whole[:3], pieces[:3], strict=True):
        assert np.allclose(a, b, atol=ROUNDING, equal_nan=True)
    assert whole[3].gaps == pieces[3].gaps
    assert whole[3].steady == pieces[3].steady


@pytest.mark.parametrize("is_counted", [True, False])
def test_rows_of_missing_ticks_are_there_and_empty(is_counted: bool):
    t = clock(2000)
    kept = np.ones(2000, bool)
    kept[500:633] = False
    sequence = np.arange(1, 2001)[kept] if is_counted else None
    rows, filtered, plain, account = decimated(t[kept], np.ones(int(kept.sum())), sequence)
    assert np.allclose(rows, t[::STEP], atol=ROUNDING)
    assert np.array_equal(np.isnan(filtered), ~kept[::STEP])
    assert np.array_equal(np.isnan(plain), ~kept[::STEP])
    assert account.missing == 14
    assert account.gaps == [(t[499], t[633])]


def test_nothing_is_carried_across_a_gap():
    t = np.delete(clock(2000), slice(1000, 1005))
    before, after = np.zeros(len(t)), np.zeros(len(t))
    after[t >= t[1000]] = 50.0
    (rows, calm, _, _), (_, leapt, _, _) = decimated(t, before), decimated(t, after)
    is_before = rows < t[1000]
    assert np.array_equal(calm[is_before], leapt[is_before], equal_nan=True)
    assert np.allclose(leapt[~is_before], 50.0, atol=ROUNDING)


def test_a_tick_that_is_late_but_counted_is_no_gap():
    t = clock(1000)
    t[400:] += 0.0009
    rows, filtered, _, account = decimated(t, np.ones(1000), np.arange(1, 1001))
    assert account.gaps == []
    assert len(rows) == 100
    assert np.isfinite(filtered).all()


def test_a_lost_number_is_a_gap_even_where_the_clock_stood_still():
    t, sequence = clock(1000), np.arange(1, 1001)
    sequence[400:] += 7
    assert decimated(t, np.ones(1000), sequence)[3].gaps == [(t[399], t[400])]


def test_time_only_goes_on():
    t = clock(1000)
    t[300:320] -= 0.1
    rows, _, _, account = decimated(t, np.ones(1000))
    assert account.dropped == 20
    assert (np.diff(rows) > 0.0).all()


def test_a_clock_that_leaps_does_not_fill_the_disk():
    t = clock(1000)
    t[500:] += FILL_MAX_S * 1000
    rows, filtered, _, account = decimated(t, np.ones(1000))
    assert len(rows) == 100
    assert np.isfinite(filtered).all()
    assert len(account.gaps) == 1


def test_lone_ticks_are_kept_as_they_are():
    t = clock(600)[::3]
    rows, filtered, _, account = decimated(t, np.arange(200.0))
    is_own = np.isfinite(filtered)
    assert np.allclose(filtered[is_own], np.arange(200.0)[::STEP], atol=ROUNDING)
    assert account.missing == int((~is_own).sum())
    assert np.allclose(rows, clock(600)[: 10 * len(rows) : STEP], atol=ROUNDING)


def test_what_was_not_a_number_stays_so_for_the_length_of_the_filter_only():
    t, values = clock(2000), np.ones(2000)
    values[1000] = np.nan
    rows, filtered, _, _ = decimated(t, values)
    strange = rows[np.isnan(filtered)]
    assert strange.min() >= t[1000] - 0.08 - ROUNDING
    assert strange.max() <= t[1000] + 0.08 + ROUNDING
