"""The figures of a virtual study are those of its report, go through JSON, and claim only what the data support."""

import json
from dataclasses import asdict
from typing import TypeVar

import numpy as np
import pytest
from tests.campaigns.virtual_study.made_up_flights import PITCH_MM, comparison, flight, main_study

from exograv.campaigns.virtual_study.flight import FAMILIARISED, flight_of
from exograv.campaigns.virtual_study.outcome import (
    DeviationComparison,
    ErrorComparison,
    Verdict,
    _verdict,
    outcome_of,
)
from exograv.errors import ConfigError
from exograv.results import json_value

LEFT_NM = {"ideal": 0.1, "ideal+left=0.1": 0.2, "ideal+left=0.4": 1.0, "ideal+left=1": 8.0}


def with_machines(slope: float = -0.5) -> list:
    """Flights whose transfer changes by `slope` per factor of ten in left over, from 0.9 at 0.1 N·m."""
    from math import log10

    flights = []
    for k in range(1, 7):
        flights.append(flight(k, FAMILIARISED))
        for name, nm in LEFT_NM.items():
            flights.append(flight(k, name, 0.1 - slope * log10(nm / 0.1), left_over_Nm=nm, friction_Nm=1.0))
    return flights


Value = TypeVar("Value")


def known(value: Value | None) -> Value:
    assert value is not None
    return value


def test_a_flight_comes_back_from_json_as_it_was():
    one = flight(1, "dam", left_over_Nm=0.2)
    assert flight_of(json.loads(json.dumps(asdict(one)))) == one


def test_all_figures_are_json_without_nan():
    json.dumps(json_value(outcome_of([*main_study(), *with_machines()], "dam")), allow_nan=False)
    json.dumps(json_value(outcome_of([flight(1, "dam")], "dam")), allow_nan=False)


def test_each_person_weighs_the_same_in_a_median():
    found = outcome_of(main_study(), "dam").groups["untrained"]
    # Persons 4, 5 and 6: 28, 35 and 22 mm in window 1, half and a quarter of it later; the middle one of nine.
    assert found.median_px == pytest.approx(14.0 / PITCH_MM)
    assert found.people == 3


def test_three_against_three_show_the_direction_and_claim_nothing():
    found = outcome_of(main_study(), "dam").direction
    for name in ("whole_flight", "first_window", "first_window_up_mm"):
        assert getattr(found, name).appears
        assert getattr(found, name).p == pytest.approx(0.1)
        assert getattr(found, name).p_min == pytest.approx(0.1)
    assert isinstance(found.whole_flight, DeviationComparison)
    assert not found.whole_flight.is_shown
    assert "cannot reach 0.05" in found.whole_flight.sentence


def test_what_the_test_shows_without_the_interval_or_the_interval_without_the_test_is_not_shown():
    assert _verdict(0.8, 1.0, [0.7, 0.9], 0.03).is_shown
    assert not _verdict(0.8, 1.0, [0.7, 0.9], 0.1).is_shown
    assert not _verdict(0.8, 1.0, [0.7, 1.1], 0.03).is_shown
    assert _verdict(1.3, 1.0, [1.1, 1.5], 0.03) == Verdict(appears=False, is_shown=False, is_opposite_shown=True)


def test_who_is_as_far_below_as_others_are_above_is_no_nearer():
    found = outcome_of(main_study(share=-1.0), "dam").direction.first_window_up_mm
    assert isinstance(found, ErrorComparison)
    assert found.trained_mm < 0.0 < found.untrained_mm
    # 24, 31 and 40 mm below against 28, 35 and 22 mm above.
    assert (found.pairs_nearer, found.pairs) == (3, 9)
    assert not found.appears


def test_where_the_trained_do_worse_the_direction_does_not_appear():
    assert not outcome_of(main_study(share=3.0), "dam").direction.whole_flight.appears


def test_each_condition_says_how_many_sessions_come_before_both_errors():
    flights = [flight(k, FAMILIARISED, sessions=1) for k in range(1, 4)]
    flights += [flight(k, "dam", 0.5, sessions=4) for k in range(1, 4)]
    found = outcome_of(flights, "dam").conditions["dam"]
    assert (found.sessions, found.sessions_familiarised) == (4, [1])


def test_without_a_group_there_is_no_direction_and_a_reason():
    found = outcome_of(comparison({"dam": 0.5}), "dam").direction.whole_flight
    assert found.appears is None
    assert "trained" in found.reason


def test_the_slope_over_what_is_left_over_is_that_of_the_law():
    found = outcome_of(with_machines(), "dam").transfer.by_left_over
    assert known(found.slope).value == pytest.approx(-0.5)
    assert "it falls" in found.sentence
    curve = known(found.curve)
    assert curve.transfer[0] == pytest.approx(0.9)
    assert all(
        low - 1e-9 <= at <= high + 1e-9
        for low, at, high in zip(known(curve.low), curve.transfer, known(curve.high), strict=True)
    )


def test_what_rises_is_not_called_falling_by_a_curve_that_may_not_rise():
    found = outcome_of(with_machines(slope=0.3), "dam").transfer.by_left_over
    assert known(found.slope).value == pytest.approx(0.3)
    assert "it rises" in found.sentence
    assert np.ptp(known(found.curve).transfer) < 1e-9


def test_a_curve_is_through_conditions_of_one_kind_and_others_are_points_beside_it():
    flights = with_machines()
    for k in range(1, 7):
        flights.append(flight(k, "dam", 3.0, left_over_Nm=0.15, friction_Nm=1.0))
        flights.append(flight(k, "ideal+friction=2", 0.3, left_over_Nm=0.1, friction_Nm=2.0))
    found = outcome_of(flights, "dam").transfer
    left_over, friction = found.by_left_over, found.by_friction
    assert left_over.through == list(LEFT_NM)
    assert known(left_over.slope).value == pytest.approx(-0.5)
    assert {one.condition for one in left_over.points if not one.is_on_curve} == {"dam"}
    assert friction.through == ["ideal", "ideal+friction=2"]
    assert {one.condition for one in friction.points if not one.is_on_curve} == {"dam"}
    assert all(", ".join(one.through) in one.sentence for one in (left_over, friction))


def test_the_same_after_more_sessions_is_another_kind():
    rows = [("ideal", 4), ("ideal", 16), ("ideal+friction=2", 4)]
    flights = [flight(k, FAMILIARISED) for k in range(1, 4)]
    flights += [flight(k, name, sessions=n, friction_Nm=1.0 + 0.1 * n) for k in range(1, 4) for name, n in rows]
    found = outcome_of(flights, "ideal").transfer.by_friction
    assert found.through == ["ideal, 4 sessions", "ideal+friction=2"]


def test_conditions_of_a_kind_each_make_no_curve_but_points():
    rows = {"dam": 0.5, "dam@quasi-direct": 0.3, "gcm": 1.0}
    found = outcome_of(comparison(rows, left_over_Nm=0.2, friction_Nm=1.0), "dam").transfer.by_friction
    assert found.curve is None
    assert {one.condition for one in found.points} == set(rows)
    assert "there is no curve" in found.sentence


def test_without_a_motor_nothing_can_be_read():
    found = outcome_of(comparison({"water": 0.5}), "water").transfer.by_friction
    assert "nothing can be read" in found.sentence


def test_few_people_have_no_band():
    flights = [one for one in with_machines() if one.person <= 3]
    assert known(outcome_of(flights, "dam").transfer.by_left_over.curve).low is None


def test_nobody_counts_twice():
    with pytest.raises(ConfigError, match="flew twice"):
        outcome_of([flight(1, "dam"), flight(1, "dam")], "dam")


def test_without_a_flight_there_is_a_sentence():
    with pytest.raises(ConfigError, match="No person flew"):
        outcome_of([], "dam")
