"""Transfer is the share of the first error that a training removed; an undefined transfer has a reason."""

from dataclasses import replace

import numpy as np
import pytest
from tests.campaigns.virtual_study.made_up_flights import ERRORS_MM, comparison, flight, touch

from exograv.campaigns.virtual_study.flight import FAMILIARISED
from exograv.campaigns.virtual_study.transfer import transfers


def test_a_training_that_removes_half_of_the_error_has_a_transfer_of_one_half():
    found = transfers(comparison({"dam": 0.5}))["dam"]
    assert found.transfer == pytest.approx(0.5)
    assert found.ci95 == pytest.approx([0.5, 0.5])
    assert found.first_touch.transfer == pytest.approx(0.5)
    assert found.median_deviation.transfer == pytest.approx(0.5)


@pytest.mark.parametrize(("share", "transfer"), [(0.0, 1.0), (1.0, 0.0), (1.5, -0.5), (-0.2, 1.2)])
def test_nothing_left_is_one_and_harm_is_below_zero(share: float, transfer: float):
    assert transfers(comparison({"dam": share}))["dam"].transfer == pytest.approx(transfer)


def test_only_the_sign_tells_an_error_on_the_other_side_from_one_that_is_left():
    found = transfers(comparison({"dam": -0.2}))["dam"]
    assert found.transfer == pytest.approx(1.2)
    assert found.median_deviation.transfer == pytest.approx(0.8)


def test_the_order_of_people_and_of_flights_changes_nothing():
    flights = [
        replace(one, touches=(touch(1, 1, 20.0 + one.person * (1.0 if one.condition == "dam" else 3.0)),))
        for one in comparison({"dam": 0.5})
    ]
    shuffled = [flights[k] for k in np.random.default_rng(1000).permutation(len(flights))]
    assert transfers(flights)["dam"] == transfers(shuffled)["dam"]


def test_where_the_error_after_familiarisation_may_be_zero_there_is_no_transfer_but_a_reason():
    errors = {1: 10.0, 2: -12.0, 3: 3.0}
    flights = [flight(k, name, 1.0, error_mm=mm) for k, mm in errors.items() for name in (FAMILIARISED, "dam")]
    found = transfers(flights)["dam"]
    assert found.transfer is None
    assert found.ci95 is None
    assert "does not differ from 0" in str(found.reason)


def test_without_any_error_there_is_nothing_to_take_away():
    flights = [flight(k, name, error_mm=0.0) for k in (1, 2, 3) for name in (FAMILIARISED, "dam")]
    assert transfers(flights)["dam"].transfer is None


def test_people_who_are_all_alike_have_no_interval():
    flights = [flight(k, name, error_mm=30.0) for k in (1, 2, 3) for name in (FAMILIARISED, "dam")]
    found = transfers(flights)["dam"]
    assert found.transfer == pytest.approx(0.0)
    assert found.ci95 is None
    assert "do not differ at all" in str(found.reason)


def test_one_person_has_a_transfer_and_no_interval():
    found = transfers(comparison({"dam": 0.25}, people=1))["dam"]
    assert found.transfer == pytest.approx(0.75)
    assert found.ci95 is None
    assert "one person" in str(found.reason)


def test_whoever_missed_the_first_window_is_left_out_and_counted():
    flights = [one for one in comparison({"dam": 0.5}) if (one.person, one.condition) != (1, "dam")]
    found = transfers([*flights, flight(1, "dam", 9.0, windows=(2, 3))])["dam"]
    assert found.transfer == pytest.approx(0.5)
    assert (found.people, found.left_out_people) == (3, 1)


def test_nobody_familiarised_is_no_transfer_and_a_reason():
    found = transfers([flight(1, "dam"), flight(2, "dam")])["dam"]
    assert found.transfer is None
    assert found.reason == "no person has both values"


def test_flights_of_the_main_study_enter_only_where_a_condition_has_no_others():
    apart = comparison({"dam": 0.5}, people=3)
    main = [flight(k, "dam", 0.1, "trained", sessions=16) for k in (1, 2, 3)]
    assert transfers([*main, *apart])["dam"].transfer == pytest.approx(0.5)
    alone = [one for one in apart if one.condition == FAMILIARISED]
    assert transfers([*main, *alone])["dam"].transfer == pytest.approx(0.9)


def test_different_numbers_of_sessions_are_conditions_of_their_own():
    flights = comparison({"dam": 0.5}, people=3) + [flight(k, "dam", 0.8, sessions=1) for k in (1, 2, 3)]
    found = transfers(flights)
    assert found["dam, 4 sessions"].transfer == pytest.approx(0.5)
    assert found["dam, 1 sessions"].transfer == pytest.approx(0.2)


def test_transfer_is_that_of_the_mean_error_and_not_the_mean_of_peoples_shares():
    shares = {1: 0.2, 2: 0.9, 3: 0.4}
    flights = [
        flight(k, name, s if name == "dam" else 1.0) for k, s in shares.items() for name in (FAMILIARISED, "dam")
    ]
    mean = sum(shares[k] * ERRORS_MM[k] for k in shares) / sum(ERRORS_MM[k] for k in shares)
    assert transfers(flights)["dam"].transfer == pytest.approx(1.0 - mean)
