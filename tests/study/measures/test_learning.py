"""Slopes, plateaus and costs of rests follow the law of the data, and are NaN where they cannot be determined."""

import numpy as np
import pytest
from tests.study.made_up_study import made_up_study

from exograv.study.measures.learning import exponential, participant_learning, session_learning, theil_sen
from exograv.study.measures.pointing import counted
from exograv.study.measures.selecting import rows


def one_session(law, windows: int = 10, **others):
    """Return the touches of one session, with deviations [px] from `law` by window and touch."""
    tables = made_up_study(
        {"trained": 1},
        {"trained": {"flight": 1}},
        windows=windows,
        law=lambda group, protocol, session, window, k, rng: (law(window, k), 0.0),
        **others,
    )
    return counted(tables)


def test_a_deviation_that_falls_by_a_tenth_each_window_has_that_slope():
    found = session_learning(one_session(lambda window, k: 100.0 * 0.9**window))
    assert found["slope_in_session"].value == pytest.approx(np.log(0.9))
    assert found["slope_in_session"].low <= np.log(0.9) <= found["slope_in_session"].high


def test_one_wild_window_does_not_pull_the_slope():
    found = session_learning(one_session(lambda window, k: 100.0 * 0.9**window * (50.0 if window == 10 else 1.0)))
    assert found["slope_in_session"].value == pytest.approx(np.log(0.9), abs=1e-9)


def test_of_two_windows_no_slope_is_told():
    assert np.isnan(theil_sen(np.array([1.0, 2.0]), np.array([0.0, 1.0])).value)


def test_the_first_window_costs_what_it_is_worse_by():
    found = session_learning(one_session(lambda window, k: 80.0 if window == 1 else 40.0))
    assert found["first_window_cost"].value == pytest.approx(np.log(2.0))
    assert found["first_window_deviation_px"].value == pytest.approx(80.0)


def test_a_session_whose_first_window_is_missing_has_no_first_window():
    touches = one_session(lambda window, k: 40.0)
    assert "first_window_cost" not in session_learning(rows(touches, touches["window"] > 1))


def test_the_first_touch_of_a_window_costs_what_it_is_worse_by():
    found = session_learning(one_session(lambda window, k: 90.0 if k == 0 else 30.0))
    assert found["first_touch_cost"].value == pytest.approx(np.log(3.0))


def test_a_long_rest_costs_more_than_a_short_one_where_the_law_says_so():
    rest = lambda window: 400.0 if window == 5 else 60.0  # noqa: E731
    law = lambda window, k: 80.0 if window == 6 and k < 4 else 20.0 * (1.1 if k < 4 else 1.0)  # noqa: E731
    found = session_learning(one_session(law, rest_s=rest))
    assert found["cost_of_long_rest"].value == pytest.approx(np.log(4.0))
    assert found["cost_of_rest"].value == pytest.approx((8.0 * np.log(1.1) + np.log(4.0)) / 9.0)


def test_a_contact_on_the_very_centre_has_a_finite_logarithm():
    assert np.isfinite(session_learning(one_session(lambda window, k: 0.0))["first_touch_cost"].value)


def test_the_exponential_is_found_within_its_interval():
    x = np.arange(1.0, 17.0)
    y = 3.0 + 1.2 * np.exp(-(x - 1.0) / 4.0) + 0.02 * np.random.default_rng(1005).normal(size=16)
    found = exponential(x, y)
    for name, truth in {"start": 1.2, "scale": 4.0, "plateau": 3.0}.items():
        assert found[name].low < truth < found[name].high
        assert found[name].value == pytest.approx(truth, rel=0.1)


@pytest.mark.parametrize("y", [np.linspace(4.0, 3.0, 16), np.full(16, 3.0)])
def test_a_plateau_that_nobody_reached_is_not_told(y: np.ndarray):
    found = exponential(np.arange(16.0), y)
    assert all(np.isnan(estimate.value) for estimate in found.values())


def test_sessions_that_each_halve_the_deviation_have_that_slope_whatever_sessions_are_missing():
    sessions = np.array([1.0, 2.0, 4.0, 7.0])
    found = participant_learning(sessions, 100.0 * 0.5**sessions)
    assert found["slope_across_sessions"].value == pytest.approx(np.log(0.5))
    assert np.isnan(found["plateau_px"].value)
