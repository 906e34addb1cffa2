"""Shaping of a taught path: the path is smooth, slow and inside; other motions are refused with place and reason."""

import numpy as np
import pytest

from exograv import motion
from exograv.errors import ConfigError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.rehabilitation.guided.path_shaping import A_MAX_RAD_S2, PERIOD_S, V_MAX_RAD_S, driven, shaped

RIG = load_rig("recupera_like_qdd")
EXO = read_exoskeleton(RIG)
DT = 0.01
LOWER, UPPER = RIG.workspace
MIDDLE = 0.5 * (LOWER + UPPER)
INSIDE = MIDDLE + 0.3 * (UPPER - LOWER)


def led(goal: np.ndarray, speed: float = 0.5) -> np.ndarray:
    """Motion there and back, with rests around it."""
    there, back = motion.go_to(MIDDLE, goal, speed, DT), motion.go_to(goal, MIDDLE, speed, DT)
    return motion.joined([motion.hold(MIDDLE, 1.0, DT), there, back, motion.hold(MIDDLE, 1.0, DT)]).q


def test_a_path_keeps_its_ends_and_its_turn():
    path = shaped(led(INSIDE), DT, RIG, EXO)
    assert path.q[0] == pytest.approx(MIDDLE, abs=np.deg2rad(1.0))
    assert path.q[-1] == pytest.approx(MIDDLE, abs=np.deg2rad(1.0))
    assert path.q.max(axis=0) == pytest.approx(INSIDE, abs=np.deg2rad(2.0))
    assert path.stretched == 1.0


def test_the_hands_tremble_is_gone():
    q = led(INSIDE)
    trembling = q + np.deg2rad(1.0) * np.sin(2 * np.pi * 8.0 * np.arange(len(q)) * DT)[:, None]
    clean, smoothed = shaped(q, DT, RIG, EXO), shaped(trembling, DT, RIG, EXO)
    assert np.ptp(smoothed.q, axis=0) == pytest.approx(np.ptp(clean.q, axis=0), abs=np.deg2rad(0.2))


def test_what_was_led_too_quickly_is_repeated_more_slowly():
    path = shaped(led(INSIDE, 3.0), DT, RIG, EXO)
    assert path.stretched > 1.5
    whole = driven(path.q, PERIOD_S, 0.001)
    assert np.abs(whole.v).max() < 1.02 * V_MAX_RAD_S
    assert np.abs(whole.a).max() < 1.1 * A_MAX_RAD_S2


def test_a_driven_path_begins_and_ends_at_rest():
    whole = driven(shaped(led(INSIDE), DT, RIG, EXO).q, PERIOD_S, 0.001)
    assert np.abs(whole.v[[0, -1]]).max() < 1e-9


def test_a_path_outside_is_refused_with_joint_place_and_time():
    outside = INSIDE.copy()
    outside[1] = UPPER[1] + np.deg2rad(12.0)
    with pytest.raises(ConfigError, match=r"shoulder_abduction reaches 6[12]° at [23]\.\d s .* allowed are"):
        shaped(led(outside), DT, RIG, EXO)


def test_an_arm_that_was_not_moved_is_no_path():
    with pytest.raises(ConfigError, match="Teach it again"):
        shaped(led(MIDDLE), DT, RIG, EXO)


def test_a_machine_that_did_not_answer_has_taught_nothing():
    q = led(INSIDE)
    q[150, 2] = np.nan
    with pytest.raises(ConfigError, match="Teach the path again"):
        shaped(q, DT, RIG, EXO)


def test_two_minutes_are_enough():
    with pytest.raises(ConfigError, match="120 s"):
        shaped(led(INSIDE, 0.01), DT, RIG, EXO)
