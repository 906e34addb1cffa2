"""The shoulder of a foreign world moves by another share, direction and shape, and follows the arm with a lag."""

import casadi as ca
import numpy as np
import pytest

from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer, parameter_truth
from exograv.rig.twin.wearer.passive import late_shift, shoulder_shift
from exograv.rig.twin.wearer.shoulder_path import ShoulderPath, draw_shoulder_path
from exograv.signals import Command

DT = 0.0005
SEEDS = range(300)
USUAL = np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)
SKELETON = draw_wearer(Disturbances.at_level(2), 0).arms[0].skeleton


def shift_mm(path: ShoulderPath | None, share: float, q: list[float]) -> float:
    angles = ca.SX.sym("q", 4)
    function = ca.Function("shift", [angles], [shoulder_shift(SKELETON, angles, share, path)])
    return 1e3 * float(function(np.deg2rad(q)))


def path(**changed) -> ShoulderPath:
    return ShoulderPath(**({"share": 0.8, "by_plane": 0.0, "turn": np.zeros(2), "lag": 0.3} | changed))


def test_share_and_lag_are_drawn_from_their_ranges():
    drawn = [draw_shoulder_path(seed) for seed in SEEDS]
    for values, (low, high) in (
        ([one.share for one in drawn], (0.3, 1.2)),
        ([one.lag for one in drawn], (0.2, 0.5)),
        (np.rad2deg([one.turn for one in drawn]).ravel().tolist(), (-40.0, 40.0)),
    ):
        assert low <= min(values) < low + 0.02 * (high - low)
        assert high - 0.02 * (high - low) < max(values) <= high


@pytest.mark.parametrize("usual", [USUAL, USUAL * [1.0, -1.0, 1.0]])
def test_the_direction_is_a_unit_vector_turned_by_both_angles(usual: np.ndarray):
    turn = np.deg2rad([30.0, -20.0])
    direction = path(turn=turn).direction(usual)
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert np.arcsin(direction[0]) == pytest.approx(turn[1])
    in_plane = direction * [0.0, 1.0, 1.0]
    assert usual @ in_plane / np.linalg.norm(in_plane) == pytest.approx(np.cos(turn[0]))
    np.testing.assert_allclose(path().direction(usual), usual, atol=1e-12)


def test_both_shoulders_move_as_mirror_images():
    turned = path(turn=np.deg2rad([25.0, 10.0]))
    mirror = np.array([1.0, -1.0, 1.0])
    np.testing.assert_allclose(turned.direction(mirror * USUAL), mirror * turned.direction(USUAL), atol=1e-12)


def test_the_second_term_depends_on_the_plane_of_elevation():
    plain = shift_mm(None, 0.8, [90.0, 0.0, 0.0, 0.0])
    forward, sideways, backward = (
        shift_mm(path(by_plane=0.3), 0.8, q) for q in ([90.0, 0.0, 0, 0], [0.0, 90.0, 0, 0], [-90.0, 0.0, 0, 0])
    )
    assert plain == pytest.approx(0.8 * 39.0)
    assert forward == pytest.approx(1.1 * 39.0)
    assert sideways == pytest.approx(0.8 * 39.0)
    assert backward == pytest.approx(0.5 * 39.0)


def test_a_step_of_the_arm_is_followed_with_the_time_of_the_lag():
    place = ca.SX.sym("place")
    step = ca.Function("step", [place], [late_shift(ca.SX(0.03), place, path(), DT).next])
    x = 0.0
    for _ in range(round(0.3 / DT)):
        x = float(step(x))
    assert x == pytest.approx(0.03 * (1.0 - np.exp(-1.0)))


def test_the_late_centre_of_a_twin_at_rest_is_on_its_path(rig):
    level = Disturbances.at_level(2, "shoulder")
    twin = Twin(rig, draw_machine(rig, level, 0), draw_wearer(level, 0), 0)
    place = twin._scene.arms[0]
    before = float(twin._scene.data.qpos[place.shifts[0]])
    for _ in range(100):
        state = twin.read()
        twin.write(Command(state.t, state.sequence, state.t + 0.1, np.zeros(4), state.current, np.full(4, 50.0)))
    assert twin._scene.data.qpos[place.shifts[0]] == pytest.approx(before, abs=2e-4)  # the spring's give under the arm


def test_a_path_that_the_estimator_does_not_assume_is_no_truth():
    home, foreign = (parameter_truth(draw_wearer(Disturbances.at_level(2, world), 0)) for world in ("home", "shoulder"))
    assert home["glenohumeral_slope"] > 0.0
    assert home["glenohumeral_forward"] == home["glenohumeral_outward"] == 0.0
    assert not any(name.startswith("glenohumeral") for name in foreign)
