"""The paired test keeps its error probability, and its interval holds exactly the shifts that it does not reject."""

import numpy as np
import pytest
from scipy import stats

from exograv.study.statistics import paired
from exograv.study.statistics.paired import exchanges, paired_comparison, paired_interval, paired_p


def test_p_is_that_of_scipy():
    values = np.random.default_rng(0).normal(0.3, 1.0, (5, 8))
    ways = exchanges(8, np.random.default_rng(0))
    for one, p in zip(values, paired_p(values, ways), strict=True):
        found = stats.permutation_test((one,), np.sum, permutation_type="samples", n_resamples=1000)
        assert p == pytest.approx(found.pvalue)


def test_drawn_exchanges_give_nearly_the_p_of_all(monkeypatch: pytest.MonkeyPatch):
    values = np.random.default_rng(1).normal(0.4, 1.0, (4, 10))
    exact = paired_p(values, exchanges(10, np.random.default_rng(0)))
    monkeypatch.setattr(paired, "ENUMERATED_MAX", 5)
    ways = exchanges(10, np.random.default_rng(0))
    assert not ways.is_complete
    assert np.allclose(paired_p(values, ways), exact, atol=0.006)


@pytest.mark.parametrize("seed", range(3))
def test_the_interval_ends_where_the_test_begins_to_reject(seed: int):
    values = np.random.default_rng(seed).normal(0.5, 1.0, 9)
    ways = exchanges(9, np.random.default_rng(0))
    interval = paired_interval(values, ways, 0.95)
    assert interval.low is not None
    assert interval.high is not None
    for end, outside in ((interval.low, -1e-6), (interval.high, 1e-6)):
        p_inside, p_outside = paired_p(np.stack([values - end + outside, values - end - outside]), ways)
        assert p_inside > 0.05 >= p_outside


def test_five_people_reach_no_0_05_and_have_no_bounded_interval():
    found = paired_comparison(np.full(5, 0.7), 0.05)
    assert found.p == found.p_min == 0.0625
    assert "cannot reach 0.05" in found.sentence
    assert found.interval.low is found.interval.high is None
    assert found.ratio == pytest.approx(np.exp(0.7))


def test_ten_people_who_all_differ_alike_show_a_difference():
    found = paired_comparison(np.linspace(-0.5, -0.3, 10), 0.05)
    assert found.p == pytest.approx(2 / 2**10)
    assert found.interval.high is not None
    assert found.interval.high < 1.0
    assert "0.2 % of cases" in found.sentence


def test_false_positives_are_at_most_five_in_a_hundred():
    values = np.random.default_rng(2).standard_t(3, (4000, 8))
    rate = float((paired_p(values, exchanges(8, np.random.default_rng(0))) <= 0.05).mean())
    assert rate < 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / 4000)
