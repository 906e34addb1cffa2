"""Simulated power agrees with theory and with touch-by-touch simulation, and is 0 if alpha cannot be reached."""

import numpy as np
import pytest

from exograv.study.power.assumptions import PlannedStudy, sure_worlds
from exograv.study.power.simulate import people, shares, touch_medians
from exograv.study.statistics.precision import t_test_power

STUDIES = 4000
FOUR_SD = 4.0 * 0.5 / np.sqrt(STUDIES)
PLAN = PlannedStudy(difference=0.6, person_sd=0.35)


def share_of(plan: PlannedStudy, n: int):
    return shares(plan, sure_worlds(plan, STUDIES), n, 1000)


@pytest.mark.parametrize("n", [2, 3])
@pytest.mark.parametrize("difference", [0.0, 0.7, 5.0])
def test_three_against_three_have_no_power_whatever_the_effect(n: int, difference: float):
    found = share_of(PlannedStudy(difference, 0.35), n)
    assert found.power == 0.0
    assert found.power_interval == (0.0, 0.0)


@pytest.mark.parametrize("n", [6, 8, 10, 16])
def test_the_exact_test_comes_near_student_s_power(n: int):
    # The noise of touches is part of the differences between people.
    sd = float(
        people(
            PlannedStudy(0.0, 0.35), sure_worlds(PlannedStudy(0.0, 0.35), 20_000), 2, np.random.default_rng(1000)
        ).std()
    )
    theory = t_test_power(n, n, PLAN.difference, sd)
    # At six against six the possible levels reduce the power by up to 0.03; drawing relabellings costs 0.005.
    assert theory - 0.03 - FOUR_SD < share_of(PLAN, n).power < theory + 0.01 + FOUR_SD


def test_without_a_difference_the_power_is_the_false_alarm_rate():
    found = share_of(PlannedStudy(0.0, 0.35), 5)
    assert found.power <= 0.05 + FOUR_SD * 0.44  # √(0.05 · 0.95) instead of 0.5
    assert found.welch_power == pytest.approx(0.05, abs=FOUR_SD * 0.44 + 0.01)


def test_the_sign_of_the_difference_does_not_matter():
    one, other = (share_of(PlannedStudy(sign * 0.6, 0.35), 6).power for sign in (1.0, -1.0))
    assert one == pytest.approx(other, abs=FOUR_SD)


@pytest.mark.parametrize("touches", [1, 2, 7, 8, 60])
def test_medians_by_beta_have_the_spread_of_medians_of_touches(touches: int):
    rng = np.random.default_rng(1001)
    slow = np.median(rng.standard_normal((40_000, touches)), axis=1).std()
    assert touch_medians(touches, (200, 200), rng).std() == pytest.approx(slow, rel=0.02)


def test_the_shortcut_agrees_with_touches_in_windows_in_flights():
    plan = PlannedStudy(0.0, 0.3, touch_sd=0.6, window_sd=0.25, flight_sd=0.2, windows=10, touches=8, flights=2)
    rng, n = np.random.default_rng(1002), 4000
    touches = 0.3 * rng.normal(size=(n, 1, 1, 1)) + 0.2 * rng.normal(size=(n, 2, 1, 1))
    touches = touches + 0.25 * rng.normal(size=(n, 2, 10, 1)) + 0.6 * rng.normal(size=(n, 2, 10, 8))
    slow = np.median(touches.reshape(n, -1), axis=1).std()
    assert people(plan, sure_worlds(plan, n), 2, rng).std() == pytest.approx(slow, rel=0.04)


def test_the_same_seed_gives_the_same_figures():
    assert share_of(PLAN, 5) == share_of(PLAN, 5)
