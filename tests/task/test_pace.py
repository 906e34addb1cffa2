"""The arrow depends only on the time since the last touch, and differs in shape as well as in colour."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.task.pace import Pace, arrow, pace, pace_changes_s
from exograv.task.protocol import load_protocol

TRAINING = load_protocol("training").settings
SINCE = st.floats(-1.0, 100.0)


@pytest.mark.parametrize(
    ("since_s", "told"),
    [
        (0.0, Pace.TOO_SHORT),
        (2.24, Pace.TOO_SHORT),
        (2.25, Pace.RIGHT),
        (2.75, Pace.RIGHT),
        (3.25, Pace.RIGHT),
        (3.26, Pace.TOO_LONG),
        (60.0, Pace.TOO_LONG),
    ],
)
def test_a_touch_every_2_75_seconds_is_right_within_half_a_second(since_s: float, told: Pace):
    assert pace(TRAINING, since_s) is told


@given(first=SINCE, later=SINCE)
def test_waiting_longer_never_leads_back(first: float, later: float):
    order = list(Pace)
    earlier, later = sorted((first, later))
    assert order.index(pace(TRAINING, earlier)) <= order.index(pace(TRAINING, later))


def test_the_changes_are_where_the_pace_changes():
    for since_s, told in pace_changes_s(TRAINING):
        assert pace(TRAINING, since_s + 1e-6) is told
    assert len(pace_changes_s(TRAINING)) == len(Pace)


def test_red_points_down_for_too_short_and_green_up_for_too_long_and_right_shows_nothing():
    signs = {told: arrow(TRAINING, told) for told in Pace}
    shown = {told: (sign.shape, sign.colour) for told, sign in signs.items() if sign is not None}
    assert shown == {Pace.TOO_SHORT: ("down", "red"), Pace.TOO_LONG: ("up", "green")}


def test_the_flight_shows_no_arrow_but_knows_the_pace():
    flight = load_protocol("flight").settings
    assert [arrow(flight, told) for told in Pace] == [None] * 3
    assert pace(flight, 10.0) is Pace.TOO_LONG
