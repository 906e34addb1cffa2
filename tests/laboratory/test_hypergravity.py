"""Levels up to 1.8 in the machine are those of a room with that gravity, and a parabola is flown on the ground."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.preloaded import script

from exograv.laboratory.hypergravity import felt_errors, fly_parabola, level_starts
from exograv.laboratory.ideal_knowledge import ideal_knowledge
from exograv.laboratory.transparency import movement_for
from exograv.laboratory.transparency_trial import TransparencyTrial
from exograv.model.description import load_rig
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.task.flight_profile import FlightProfile

FLIGHTS = Path(__file__).with_name("hypergravity_flights.py")
SHORT = FlightProfile(parabolas=1, level=0.9, hyper_level=1.1, hyper_s=1.5, window_s=1.5)
SEED = 1022


def test_the_ramps_of_a_parabola_leave_the_window_its_length():
    profile = FlightProfile()
    (up, _), (down, down_s), (again, again_s), (earth, earth_s) = level_starts(profile)
    assert (up, down, again, earth) == (1.8, 0.0, 1.8, 1.0)
    opens, closes = profile.windows_s[0]
    assert down_s + 1.8 * GRAVITY_LEVEL_S == pytest.approx(opens)
    assert again_s == pytest.approx(closes)
    assert again_s + 1.8 * GRAVITY_LEVEL_S < earth_s


def test_a_short_parabola_changes_the_level_no_faster_than_the_guard_allows():
    description = load_rig("recupera_like_qdd")
    trial = TransparencyTrial(description, 0, SEED)
    known = ideal_knowledge(trial.laboratory(), 0.0)
    flown = fly_parabola(trial, known, movement_for("pointing", description), SHORT)
    assert (flown.level.max(), flown.level.min()) == pytest.approx((1.1, 0.9))
    assert np.abs(np.diff(flown.level)).max() < 1.01 * np.diff(flown.t).max() / GRAVITY_LEVEL_S
    assert flown.level[-1] == pytest.approx(1.0)
    assert flown.off_deg < 15.0
    at_earth, pulled = felt_errors(trial, known, (1.0, 1.8)).values()
    assert at_earth.max() < 0.02
    assert pulled.max() < 0.05


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """Figures of a calibrated machine and an identified arm."""
    return json.loads(script(FLIGHTS, folder=tmp_path_factory.mktemp("hypergravity")).stdout)


@pytest.mark.long
def test_an_error_of_the_arm_s_weight_is_felt_by_the_share_that_the_machine_makes(flown: dict[str, Any]):
    weightless, earth, pulled_up = (np.array(error) for error in flown["felt_Nm"])
    assert (earth < 0.05).all()
    np.testing.assert_allclose(pulled_up, 0.8 * weightless, atol=0.06)
    assert weightless.max() > 0.5


@pytest.mark.long
def test_a_movement_at_1_8_g_in_the_machine_takes_the_muscle_torque_of_a_room_with_1_8_g(flown: dict[str, Any]):
    assert flown["lowest"] == 1.8
    assert flown["keeps_path"]
    machine, room = flown["effort_Nms"]
    assert machine == pytest.approx(room, rel=0.1)


@pytest.mark.long
def test_a_parabola_on_the_ground_reaches_its_levels_and_the_person_keeps_the_posture(flown: dict[str, Any]):
    assert flown["pulled_s"] > 30.0
    assert flown["weightless_s"] > 22.0
    assert flown["off_deg"] < 15.0
