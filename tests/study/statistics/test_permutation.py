"""The exact test enumerates all groupings, and its intervals have the stated coverage."""

from math import comb

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from exograv.study.statistics.permutation import pair_interval, permutation_test, rank_test, shift_interval
from exograv.study.statistics.relabelling import generic_smallest_p, relabellings, smallest_p, two_sided

RNG = np.random.default_rng(1000)
SIZES = st.tuples(st.integers(1, 5), st.integers(1, 5))
STUDIES = 4000


def drawn(n: tuple[int, int], seed: int, digits: int = 6) -> np.ndarray:
    """Draw rounded values of people of both groups; few digits make equal values."""
    return np.random.default_rng(1000 + seed).normal(size=sum(n)).round(digits)


def ways_of(n: tuple[int, int]):
    return relabellings(*n, RNG)


@given(n=SIZES, seed=st.integers(0, 1000), digits=st.integers(0, 6))
def test_no_p_value_is_below_the_smallest_possible(n: tuple[int, int], seed: int, digits: int):
    values, ways = drawn(n, seed, digits), ways_of(n)
    p_min = smallest_p(values, ways)
    assert two_sided(values[None], ways)[0] >= p_min >= generic_smallest_p(*n) - 1e-12


@given(n=SIZES, seed=st.integers(0, 1000))
def test_somebodys_grouping_reaches_the_smallest_possible(n: tuple[int, int], seed: int):
    values, ways = drawn(n, seed, 1), ways_of(n)
    regrouped = [np.concatenate([values[label], values[~label]]) for label in ways.in_first]
    assert two_sided(np.array(regrouped), ways).min() == pytest.approx(smallest_p(values, ways))


@pytest.mark.parametrize("n", [(3, 3), (4, 4), (5, 5), (6, 6)])
def test_the_smallest_p_of_equal_groups_is_that_of_the_reference(n: tuple[int, int]):
    published = {3: 0.100, 4: 0.029, 5: 0.0079, 6: 0.0022}  # reference/protocol_and_study.md, section 6
    assert generic_smallest_p(*n) == pytest.approx(published[n[0]], rel=0.02)
    assert len(ways_of(n).in_first) == comb(2 * n[0], n[0])


@given(n=st.tuples(st.integers(2, 5), st.integers(2, 5)), seed=st.integers(0, 1000))
def test_it_agrees_with_scipy(n: tuple[int, int], seed: int):
    values = drawn(n, seed)
    first, second = values[: n[0]], values[n[0] :]
    theirs = stats.permutation_test((first, second), lambda a, b, axis: a.mean(axis) - b.mean(axis), vectorized=True)
    assert permutation_test(values, ways_of(n), 0.05).p == pytest.approx(theirs.pvalue)
    ranks = stats.mannwhitneyu(first, second, method="exact")
    assert rank_test(values, ways_of(n), 0.05).p == pytest.approx(ranks.pvalue)


@given(n=SIZES, seed=st.integers(0, 1000))
def test_which_group_is_called_first_does_not_matter(n: tuple[int, int], seed: int):
    values = drawn(n, seed, 1)
    swapped = np.concatenate([values[n[0] :], values[: n[0]]])
    p = [two_sided(v[None], ways_of(m))[0] for v, m in ((values, n), (swapped, (n[1], n[0])))]
    assert p[0] == pytest.approx(p[1])


def test_people_who_are_all_alike_give_one():
    test = permutation_test(np.full(6, 4.2), ways_of((3, 3)), 0.05)
    assert (test.p, test.p_min) == (1.0, 1.0)


def test_a_shift_at_the_interval_s_end_is_where_the_test_begins_to_reject():
    values, ways = drawn((4, 5), 3), ways_of((4, 5))
    interval = shift_interval(values, ways, 0.95)
    assert interval.low is not None
    assert interval.high is not None
    first = np.arange(9) < 4
    for shift, is_kept in (
        (interval.low - 1e-6, False), (interval.low + 1e-6, True), (interval.high - 1e-6, True),
        (interval.high + 1e-6, False),
    ):  # fmt: skip
        p = two_sided((values - shift * first)[None], ways)[0]
        assert (p > 0.05) == is_kept


def test_three_against_three_have_an_interval_at_ninety_percent_and_none_above():
    values, ways = drawn((3, 3), 5), ways_of((3, 3))
    assert shift_interval(values, ways, 0.95).low is None
    assert pair_interval(values, ways, 0.95)[1].low is None
    low = float(values[:3].min() - values[3:].max())
    assert shift_interval(values, ways, 0.9).low == pytest.approx(low)
    assert pair_interval(values, ways, 0.9)[1].low == pytest.approx(low)


@pytest.mark.parametrize("interval_of", [shift_interval, lambda *a: pair_interval(*a)[1]])
def test_intervals_of_three_against_three_hold_the_truth_as_often_as_they_say(interval_of):
    # Cauchy values show that the level does not depend on normality.
    rng, ways, shift = np.random.default_rng(1001), ways_of((3, 3)), 0.7
    held = 0
    for people in rng.standard_cauchy((STUDIES, 6)) + shift * (np.arange(6) < 3):
        interval = interval_of(people, ways, 0.9)
        held += interval.low <= shift <= interval.high
    assert abs(held / STUDIES - 0.9) < 4.0 * np.sqrt(0.9 * 0.1 / STUDIES)


@pytest.mark.parametrize("n", [(3, 3), (4, 4), (5, 3), (6, 6)])
def test_the_false_alarm_rate_is_never_above_alpha(n: tuple[int, int]):
    # The rate is exact: with distinct people all groupings are equally likely, so all of them are tried.
    values, ways = drawn(n, 7), ways_of(n)
    regrouped = np.array([np.concatenate([values[label], values[~label]]) for label in ways.in_first])
    p = two_sided(regrouped, ways)
    for alpha in (0.01, 0.05, 0.1, 0.2, 0.5):
        assert (p <= alpha + 1e-12).mean() <= alpha + 1e-12


def test_drawn_relabellings_come_near_the_counted_ones_and_say_how_near():
    values = drawn((5, 5), 9) + 0.8 * (np.arange(10) < 5)
    exact = two_sided(values[None], ways_of((5, 5)))[0]
    some = relabellings(5, 5, np.random.default_rng(1002), counted_max=10, drawn=9_999)
    test = permutation_test(values, some, 0.05)
    assert test.p_interval is not None
    assert test.p_interval[0] <= exact <= test.p_interval[1]
    assert test.p_min == pytest.approx(2 / 10_000)
    assert "drawn" in test.name
