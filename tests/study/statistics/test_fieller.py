"""The interval of a ratio of means over the same people holds the true value, and is None if it is unbounded."""

import numpy as np
import pytest

from exograv.study.statistics.fieller import fieller, mean_interval

STUDIES = 1500
FOUR_ERRORS = 0.0225
"""Four standard errors of a rate of 0.95 in the number of studies."""


@pytest.mark.parametrize("n", [3, 6])
def test_ninety_five_of_a_hundred_intervals_hold_the_truth(n: int):
    rng, held = np.random.default_rng([1000, n]), 0
    for _ in range(STUDIES):
        below = 30.0 + 4.0 * rng.standard_normal(n)
        found = fieller(0.4 * below + 3.0 * rng.standard_normal(n), below + 3.0 * rng.standard_normal(n))
        assert found.interval is None or found.value is not None
        ends = (found.interval.low, found.interval.high) if found.interval else (None, None)
        # An unbounded set of ratios counts neither as hit nor as miss; it is rare here.
        held += ends[0] is None or ends[1] is None or ends[0] <= 0.4 <= ends[1]
    assert held / STUDIES == pytest.approx(0.95, abs=FOUR_ERRORS)


def test_over_people_who_are_alike_below_it_is_students_interval_of_the_mean():
    above = np.array([1.0, 2.0, 4.0, 5.0])
    found, usual = fieller(above, np.full(4, 2.0)).interval, mean_interval(above / 2.0)
    assert found is not None
    assert usual is not None
    assert (found.low, found.high) == pytest.approx((usual.low, usual.high))


def test_the_unit_does_not_matter():
    above, below = np.array([1.0, 2.5, 2.0]), np.array([4.0, 6.0, 5.0])
    one, other = fieller(above, below).interval, fieller(25.4 * above, 25.4 * below).interval
    assert one is not None
    assert other is not None
    assert (one.low, one.high) == pytest.approx((other.low, other.high))


def test_a_mean_below_that_may_be_zero_gives_a_reason_and_no_value():
    found = fieller(np.array([1.0, 2.0, 3.0]), np.array([-1.0, 1.0, 2.0]))
    assert found.value is None
    assert "does not differ from 0" in found.reason


def test_nobody_has_no_ratio():
    assert fieller(np.array([]), np.array([])).value is None
