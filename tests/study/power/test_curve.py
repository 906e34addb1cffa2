"""The curve rises to the requested power, states what cannot be reached, and includes the pilot's uncertainty."""

import json

import numpy as np
import pytest
from tests.study.statistics.made_up_touches import GROUPS, made_up_touches

from exograv.errors import ConfigError
from exograv.results import json_value
from exograv.study.power.assumptions import PlannedStudy
from exograv.study.power.curve import PowerResult, power_study, seats
from exograv.study.power.options import CurveOptions, Price
from exograv.study.power.pilot import read_pilot

ASKED = CurveOptions(n_max=8, studies=1000, seed=1000)


def quiet(_text: str, _share: float) -> None:
    pass


def made(plan: PlannedStudy, **more) -> PowerResult:
    result = power_study(plan, Price(), ASKED, quiet, **more)
    assert json.dumps(json_value(result), allow_nan=False)
    return result


def test_the_curve_holds_the_numbers_that_it_gives():
    result = made(PlannedStudy(0.693, 0.35))
    by_n = {row.n: row.power for row in result.curve}
    for target in ("80", "90"):
        n = result.n_per_group[target]
        assert n is not None
        assert by_n[n] >= int(target) / 100 > by_n[n - 1]
    assert by_n[3] == 0.0
    assert any("cannot reach 0.05" in sentence for sentence in result.sentences)


def test_what_is_not_reached_is_none_and_said():
    result = made(PlannedStudy(0.05, 0.5))
    assert result.n_per_group == {"80": None, "90": None}
    assert any("is not found in 80 % of studies" in sentence for sentence in result.sentences)


def test_more_people_narrow_the_interval_and_more_touches_hardly():
    result = made(PlannedStudy(0.693, 0.35))
    widths = [row.width_factor for row in result.curve]
    assert widths == sorted(widths, reverse=True)
    rows = {row.touches: row.power for row in result.matters.rows if row.touches is not None}
    assert abs(rows[16] - rows[4]) < 0.05


def test_flights_matter_where_people_differ_from_flight_to_flight():
    rows = {
        row.flights: row.power
        for row in made(PlannedStudy(0.693, 0.2, flight_sd=0.5)).matters.rows
        if row.flights is not None
    }
    assert rows[3] > rows[1] + 0.05


def test_seats_flights_and_cost_follow_the_number_of_people():
    row = seats(7, PlannedStudy(0.7, 0.35, flights=2), Price(6000.0, 12))
    assert row == (28, 3, 168_000.0)
    assert seats(2, PlannedStudy(0.7, 0.35, flights=3), Price(None, 40)) == (12, 3, None)


def test_a_pilot_of_many_people_gives_back_what_was_put_in():
    law = {"person_sd": 0.35, "touch_sd": 0.6, "windows": 6, "touches": 8}
    pilot = read_pilot(*made_up_touches((25, 25), **law), GROUPS, "flight")
    assert pilot.grid.person_sd_quantile(0.5) == pytest.approx(0.35, rel=0.25)
    assert pilot.touch_sd == pytest.approx(0.6, rel=0.05)
    assert pilot.window_sd < 0.1
    assert (pilot.windows, pilot.touches_per_window) == (6, 8.0)


def test_windows_that_differ_are_found_in_the_pilot():
    touches, participants = made_up_touches((10, 10), windows=12)
    rng = np.random.default_rng(1003)
    shift = {key: np.exp(0.4 * rng.normal()) for key in touches.groupby(["participant", "window"]).groups}
    keys = zip(touches["participant"], touches["window"], strict=True)
    touches["deviation_px"] *= [shift[key] for key in keys]
    pilot = read_pilot(touches, participants, GROUPS, "flight")
    assert pilot.window_sd == pytest.approx(0.4, rel=0.2)
    assert pilot.touch_sd == pytest.approx(0.6, rel=0.06)


def test_assurance_of_a_small_pilot_is_below_the_power_that_ignores_its_doubt():
    pilot = read_pilot(*made_up_touches((3, 3), seed=1004), GROUPS, "flight")
    plan = PlannedStudy(pilot.difference, pilot.grid.person_sd_quantile(0.5), pilot.touch_sd)
    result = made(plan, pilot=pilot, is_stated=False)
    last = result.curve[-1]
    assert (last.assurance or 1.0) < last.power
    assert any("Give a difference that is worth finding with --difference" in sentence for sentence in result.sentences)
    assert any("assurance" in sentence for sentence in result.sentences)


def test_a_pilot_of_hardly_anybody_is_refused_with_the_way_on():
    with pytest.raises(ConfigError, match="Give --sd and --difference"):
        read_pilot(*made_up_touches((1, 1)), GROUPS, "flight")


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: PlannedStudy(0.7, -0.1), "--sd"),
        (lambda: PlannedStudy(float("nan"), 0.1), "--difference"),
        (lambda: PlannedStudy(-6.0, 0.1), "--difference is -6; give log units from -5 to 5"),
        (lambda: PlannedStudy(0.7, 50.0), "--sd is 50"),
        (lambda: PlannedStudy(0.7, 0.35, windows=0), "--windows"),
        (lambda: PlannedStudy(0.7, 0.35, alpha=0.7), "--alpha"),
        (lambda: Price(-1.0), "--seat-cost"),
        (lambda: Price(seats_per_flight=0), "--seats-per-flight"),
        (lambda: CurveOptions(n_max=1), "--n-max"),
        (lambda: CurveOptions(studies=5), "--studies"),
        (lambda: CurveOptions(seed=-1), "--seed"),
    ],
)
def test_what_cannot_be_is_refused_by_its_option(make, word: str):
    with pytest.raises(ConfigError, match=word):
        make()
