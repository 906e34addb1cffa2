"""A mean over a period is the mean of its samples, bit for bit, whether or not a motion was requested."""

import numpy as np
import pytest

from exograv.identification.core.interface import RequestedMotion, Sample
from exograv.identification.core.sample_pace import BATCH_PERIOD_S, Averages

JOINTS = 3


@pytest.mark.parametrize("is_requested", [False, True])
def test_a_mean_is_that_of_all_rows_of_the_period(is_requested: bool):
    generator, averages, period = np.random.default_rng(0), Averages(BATCH_PERIOD_S), []
    means = 0
    for k in range(400):
        rows = generator.standard_normal((7 if is_requested else 4, JOINTS))
        period.append(rows)
        asked = RequestedMotion(rows[4], rows[5], rows[6]) if is_requested else None
        kept = averages.take(Sample(0.001 * k, rows[0], rows[1], rows[2], rows[3], asked))
        if kept is not None:
            expected = np.mean(period, axis=0)
            assert np.array_equal(np.array([kept.q, kept.v, kept.a, kept.tau]), expected[:4])
            if is_requested:
                assert kept.asked is not None
                assert np.array_equal(np.array([kept.asked.q, kept.asked.v, kept.asked.a]), expected[4:])
            means += 1
            period.clear()
    assert means >= 4


def test_a_mean_is_the_same_for_arrays_of_any_layout():
    generator, plain, strided = np.random.default_rng(0), Averages(BATCH_PERIOD_S), Averages(BATCH_PERIOD_S)
    means = 0
    for k in range(200):
        rows = generator.standard_normal((4, JOINTS))
        one = plain.take(Sample(0.001 * k, rows[0], rows[1], rows[2], rows[3]))
        q, v, a, tau = (np.repeat(row, 2)[::2] for row in rows)
        other = strided.take(Sample(0.001 * k, q, v, a, tau))
        assert (one is None) == (other is None)
        if one is not None and other is not None:
            means += 1
            np.testing.assert_array_equal([one.q, one.v, one.a, one.tau], [other.q, other.v, other.a, other.tau])
    assert means > 1


@pytest.mark.parametrize("is_requested", [False, True])
def test_a_mean_holds_the_mean_of_the_muscles_signals(is_requested: bool):
    generator, averages, period = np.random.default_rng(0), Averages(BATCH_PERIOD_S), []
    row, means = np.zeros(JOINTS), 0
    for k in range(200):
        period.append(generator.standard_normal(5))
        asked = RequestedMotion(row, row, row) if is_requested else None
        kept = averages.take(Sample(0.001 * k, row, row, row, row, asked, period[-1]))
        if kept is not None:
            assert kept.muscles is not None
            np.testing.assert_array_equal(kept.muscles, np.mean(period, axis=0))
            assert (kept.asked is not None) == is_requested
            means += 1
            period.clear()
    assert means > 1
