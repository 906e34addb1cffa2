"""Levels up to 1.8 in the machine are those of a room with that gravity, and a parabola is flown on the ground."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.laboratory.hypergravity import compare, felt_errors, fly_parabola, level_starts
from exograv.laboratory.preparation import prepare
from exograv.laboratory.transparency import movement_for
from exograv.laboratory.transparency_trial import TransparencyTrial
from exograv.model.description import load_rig
from exograv.safety.guard import GRAVITY_LEVEL_S
from exograv.task.flight_profile import FlightProfile

SEED = 1021
"""Figures are reported on other seeds (docs/results/results.md)."""


def test_the_ramps_of_a_parabola_leave_the_window_its_length():
    profile = FlightProfile()
    (up, _), (down, down_s), (again, again_s), (earth, earth_s) = level_starts(profile)
    assert (up, down, again, earth) == (1.8, 0.0, 1.8, 1.0)
    opens, closes = profile.windows_s[0]
    assert down_s + 1.8 * GRAVITY_LEVEL_S == pytest.approx(opens)
    assert again_s == pytest.approx(closes)
    assert again_s + 1.8 * GRAVITY_LEVEL_S < earth_s


@pytest.fixture(scope="module")
def quasi_direct():
    """Trial on quasi-direct drives, what control knows after calibration and identification, and a movement."""
    description = load_rig("recupera_like_qdd")
    trial = TransparencyTrial(description, 2, SEED)
    known = prepare(trial.laboratory(), SEED, lambda _text, _share: None)
    return trial, known, movement_for("pointing", description)


@pytest.mark.long
def test_an_error_of_the_arm_s_weight_is_felt_by_the_share_that_the_machine_makes(quasi_direct):
    trial, known, _ = quasi_direct
    heavier = replace(known, x=1.2 * known.x)
    weightless, earth, pulled_up = felt_errors(trial, heavier, (0.0, 1.0, 1.8)).values()
    assert (earth < 0.05).all()
    np.testing.assert_allclose(pulled_up, 0.8 * weightless, atol=0.06)
    assert weightless.max() > 0.5


@pytest.mark.long
def test_a_movement_at_1_8_g_in_the_machine_takes_the_muscle_torque_of_a_room_with_1_8_g(quasi_direct):
    trial, known, movement = quasi_direct
    found = compare(trial, known, 1.8, movement)
    assert found.lowest == 1.8
    assert found.machine.keeps_path
    assert found.machine.absolute.sum() == pytest.approx(found.room.absolute.sum(), rel=0.1)


@pytest.mark.long
def test_a_parabola_on_the_ground_reaches_its_levels_and_the_person_keeps_the_posture(quasi_direct):
    trial, known, movement = quasi_direct
    flown = fly_parabola(trial, known, movement, FlightProfile(parabolas=1))
    step = np.diff(flown.t).mean()
    assert (flown.level > 1.75).sum() * step > 30.0
    assert (flown.level < 0.01).sum() * step > 22.0
    assert flown.off_deg < 15.0
