"""A virtual participant without machine knows only what was learned, and equal people differ only by noise."""

from typing import Any

import numpy as np
import pytest

from exograv.campaigns.virtual_study import validation_reaches
from exograv.campaigns.virtual_study.validation_reaches import Reaching
from exograv.laboratory.participant.adaptation import AdaptationRates
from exograv.laboratory.participant.habits import Habits
from exograv.laboratory.participant.virtual_participant import PointingPerson

SURE: dict[str, Any] = {
    "bias_sd_deg": 0.0,
    "felt_sd_deg": 0.0,
    "motor_noise": 0.0,
    "seen_sd_m": 0.0,
    "interval_sd": 0.0,
}
STEADY = AdaptationRates(felt_sd=0.0)
PERIODS_MM = 3.0
"""Tolerance between acts every 1 ms and every 2 ms [mm]; muscles lag by 40 ms."""

ALIKE_MM = 6.0
"""Tolerance between windows [mm]; the twin's wearer does not relax completely."""


def first_up(seed: int, gravity: float, windows: int, habits: Habits) -> list[float]:
    reaching = Reaching(seed, gravity, True, habits, level=0)
    return [reaching.window(4.5)[0].up_mm for _ in range(windows)]


@pytest.mark.slow
def test_without_weight_the_first_touch_is_too_high_and_with_more_it_is_too_low():
    light, usual, heavy = (first_up(1020, g, 1, Habits(**SURE, rates=STEADY))[0] for g in (0.0, 1.0, 1.8))
    assert light > usual + 5.0
    assert heavy < usual - 5.0


@pytest.mark.slow
def test_without_noise_two_equal_people_land_alike_and_with_it_they_do_not():
    one, other = (first_up(1020, 0.0, 1, Habits(**SURE, rates=STEADY)) for _ in range(2))
    assert one == other
    assert first_up(1020, 0.0, 1, Habits()) != one


@pytest.mark.slow
def test_who_neither_trusts_nor_learns_lands_as_high_in_the_second_window_as_in_the_first():
    stubborn = Habits(
        **SURE, trusts_felt=0.0, learns_aim=0.0, rates=AdaptationRates(felt_sd=0.0, fast_learns=0.0, slow_learns=0.0)
    )
    first, second = first_up(1020, 0.0, 2, stubborn)
    assert second == pytest.approx(first, abs=ALIKE_MM)
    assert first > 50.0


@pytest.mark.long
def test_how_often_muscles_are_asked_hardly_moves_the_first_touch(monkeypatch: pytest.MonkeyPatch):
    places = []
    for ticks in (1, 2):
        monkeypatch.setattr(validation_reaches, "TICKS", ticks)
        places.append(first_up(1020, 0.0, 1, Habits(**SURE, rates=STEADY))[0])
    assert abs(np.diff(places)[0]) < PERIODS_MM


def test_who_sees_nothing_learns_nothing():
    reaching = Reaching(1020, 0.0, False, Habits(**SURE, rates=STEADY), level=0)
    person: PointingPerson = reaching.person
    assert len(reaching.window(4.5)) >= 1
    assert not any(person.learned.aim)
    assert not any(person.learned.slow)
