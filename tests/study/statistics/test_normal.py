"""Normal theory agrees with SciPy, and its intervals hold the true value at three against three."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from exograv.study.statistics.normal import (
    hedges_g,
    noncentral_t_cdf,
    ratio_effect,
    welch_interval,
    welch_p,
    welch_test,
)

STUDIES = 4000
FOUR_SD = 4.0 * np.sqrt(0.95 * 0.05 / STUDIES)
SIZES = st.tuples(st.integers(2, 6), st.integers(2, 6))


def people(n: tuple[int, int], seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1000 + seed)
    return rng.normal(3.9, 0.3, n[0]), rng.normal(4.6, 0.4, n[1])


@given(n=SIZES, seed=st.integers(0, 1000))
def test_welch_agrees_with_scipy(n: tuple[int, int], seed: int):
    first, second = people(n, seed)
    theirs: Any = stats.ttest_ind(first, second, equal_var=False)
    difference, ours = welch_interval(first, second)
    assert ours is not None
    assert difference == pytest.approx(first.mean() - second.mean())
    assert (ours.low, ours.high) == pytest.approx(tuple(theirs.confidence_interval(0.95)))
    assert welch_p(first[None], second[None])[0] == pytest.approx(theirs.pvalue)


@given(n=SIZES, seed=st.integers(0, 1000))
def test_the_interval_leaves_one_out_exactly_when_welch_s_p_is_small(n: tuple[int, int], seed: int):
    first, second = people(n, seed)
    test, effect = welch_test(first, second, 0.05), ratio_effect(first, second, ("a", "b"))
    assert test is not None
    assert test.p is not None
    assert effect.interval is not None
    assert effect.interval.low is not None
    assert effect.interval.high is not None
    assert (effect.interval.low <= 1.0 <= effect.interval.high) == (test.p > 0.05)


@pytest.mark.parametrize(("spreads", "lowest"), [((0.35, 0.35), 0.95), ((0.2, 0.6), 0.945)])
def test_welch_s_interval_holds_the_truth_at_three_against_three(spreads: tuple[float, float], lowest: float):
    """Check the coverage, which is slightly lower for unequal spreads: `benchmarks/false_positives.py --coverage`."""
    rng, shift, held = np.random.default_rng(1003), -0.7, 0
    for draw in rng.normal(size=(STUDIES, 2, 3)):
        _, interval = welch_interval(shift + spreads[0] * draw[0], spreads[1] * draw[1])
        assert interval is not None
        assert interval.low is not None
        assert interval.high is not None
        held += interval.low <= shift <= interval.high
    assert held / STUDIES > lowest - FOUR_SD


def test_hedges_g_is_unbiased_and_its_interval_holds_the_truth_at_three_against_three():
    rng, truth = np.random.default_rng(1004), -2.0
    studies = 1000
    found: list[Any] = [hedges_g(truth + draw[0], draw[1]) for draw in rng.normal(size=(studies, 2, 3))]
    values = np.array([effect.value for effect in found if effect])
    held = np.mean([effect.interval.low <= truth <= effect.interval.high for effect in found if effect])
    assert abs(values.mean() - truth) < 4.0 * values.std() / np.sqrt(studies)
    assert abs(held - 0.95) < 4.0 * np.sqrt(0.95 * 0.05 / studies)


@pytest.mark.parametrize("freedom", [1, 2, 4, 10, 58])
@pytest.mark.parametrize(("t", "noncentrality"), [(0.0, 0.0), (2.3, 1.0), (-2.8, 1.5), (6.0, 4.0), (1.0, -3.0)])
def test_the_noncentral_t_distribution_agrees_with_scipy_where_that_has_one(freedom, t, noncentrality):
    theirs = stats.nct.cdf(t, freedom, noncentrality)
    assert noncentral_t_cdf(t, freedom, noncentrality) == pytest.approx(theirs, abs=1e-6)
    assert noncentral_t_cdf(3.0, freedom, 60.0) < 0.05


@given(shift=st.floats(-1e4, 1e4))
def test_g_has_an_interval_about_it_however_large_it_is(shift: float):
    found: Any = hedges_g(np.array([0.0, 1.0, 2.0]) + shift, np.array([0.0, 0.5, 1.5]))
    assert found.interval.low < found.interval.high
    assert found.interval.low - 1.0 <= found.value <= found.interval.high + 1.0


def test_one_person_in_a_group_gives_an_effect_without_interval():
    effect = ratio_effect(np.array([3.9]), np.array([4.6, 4.7]), ("a", "b"))
    assert effect.interval is None
    assert effect.value == pytest.approx(np.exp(3.9 - 4.65))
    assert welch_test(np.array([3.9]), np.array([4.6, 4.7]), 0.05) is None


def test_people_who_do_not_differ_within_groups_give_no_g_and_no_crash():
    first, second = np.full(3, 3.9), np.full(3, 4.6)
    assert hedges_g(first, second) is None
    assert welch_p(first[None], second[None])[0] == 0.0
    assert welch_p(first[None], first[None])[0] == 1.0
