"""The shoulder of the unseen world moves on a curve, by polynomials of elevation, and swings behind the arm."""

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.rig.twin import Disturbances, Twin, draw_machine, draw_wearer, parameter_truth
from exograv.rig.twin.wearer.curved_path import ACROSS_MAX, CurvedPath, draw_curved_path
from exograv.rig.twin.wearer.passive import curved_shifts, swinging_shift
from exograv.rig.twin.wearer.shoulder_path import TURN_MAX
from exograv.signals import Command

DT = 0.0005
SEEDS = range(300)
USUAL = np.array([0.0, 1.0, 1.0]) / np.sqrt(2.0)
SKELETON = draw_wearer(Disturbances.at_level(2), 0).arms[0].skeleton

# The corner at the hanging arm is rounded, so that the elevation is exact at 90° only.
ROUNDED_MM = 1.5


def path(**changed) -> CurvedPath:
    usual = {
        "share": 1.0, "along": (0.0, 0.0), "across_m": 0.0, "across": (0.0, 0.0), "by_plane_m": 0.0,
        "turn": np.zeros(2), "lag": 0.3, "damping_ratio": 0.7,
    }  # fmt: skip
    return CurvedPath(**(usual | changed))


def shifts_mm(one: CurvedPath, q: list[float]) -> np.ndarray:
    angles = ca.SX.sym("q", 4)
    function = ca.Function("shifts", [angles], [ca.vertcat(*curved_shifts(SKELETON, angles, one))])
    return 1e3 * np.asarray(function(np.deg2rad(q))).ravel()


def test_the_draws_fill_their_ranges():
    drawn = [draw_curved_path(seed) for seed in SEEDS]
    for values, (low, high) in (
        ([one.share for one in drawn], (0.3, 1.2)),
        ([one.lag for one in drawn], (0.15, 0.5)),
        ([one.damping_ratio for one in drawn], (0.5, 1.5)),
        ([one.across_m for one in drawn], (-ACROSS_MAX, ACROSS_MAX)),
        (np.ravel([one.turn for one in drawn]).tolist(), (-TURN_MAX, TURN_MAX)),
    ):
        assert low <= min(values) < low + 0.02 * (high - low)
        assert high - 0.02 * (high - low) < max(values) <= high


@pytest.mark.parametrize("elevation", [40.0, 90.0, 130.0])
def test_both_shifts_are_polynomials_of_the_elevation(elevation: float):
    one = path(share=0.8, along=(0.6, -0.1), across_m=0.015, across=(-0.4, 0.2))
    x = elevation / 90.0
    wanted = [0.8 * 39.0 * (0.5 * x + 0.6 * x**2 - 0.1 * x**3), 15.0 * (1.2 * x - 0.4 * x**2 + 0.2 * x**3)]
    tolerance = 1e-9 if elevation == 90.0 else ROUNDED_MM
    np.testing.assert_allclose(shifts_mm(one, [0.0, elevation, 0.0, 0.0]), wanted, atol=tolerance)


def test_an_arm_that_points_forward_moves_the_centre_across():
    one = path(by_plane_m=0.01)
    at = [shifts_mm(one, q)[1] for q in ([90.0, 0.0, 0.0, 0.0], [0.0, 90.0, 0.0, 0.0], [-90.0, 0.0, 0.0, 0.0])]
    np.testing.assert_allclose(at, [10.0, 0.0, -10.0], atol=1e-9)


def test_the_centre_of_a_hanging_arm_stays():
    np.testing.assert_allclose(shifts_mm(draw_curved_path(3), [0.0, 0.0, 0.0, 0.0]), 0.0, atol=1e-12)


@pytest.mark.parametrize("usual", [USUAL, USUAL * [1.0, -1.0, 1.0]])
def test_both_directions_are_unit_vectors_at_right_angles(usual: np.ndarray):
    directions = np.array(draw_curved_path(5).directions(usual))
    np.testing.assert_allclose(directions @ directions.T, np.eye(2), atol=1e-12)
    assert directions[1][0] > 0.0  # forward


def test_both_shoulders_move_as_mirror_images():
    mirror = np.array([1.0, -1.0, 1.0])
    one = draw_curved_path(5)
    for right, left in zip(one.directions(USUAL), one.directions(mirror * USUAL), strict=True):
        np.testing.assert_allclose(left, mirror * right, atol=1e-12)


def followed(one: CurvedPath, shift, seconds: float) -> np.ndarray:
    """Places of the centre while the arm asks for `shift(t)` [m]."""
    state, asked = ca.SX.sym("state", 1, 2), ca.SX.sym("asked")
    step = kernel.compile(ca.Function("step", [asked, state], [swinging_shift(asked, state, one, DT).next])).of
    now, places = np.zeros((1, 2)), []
    for k in range(round(seconds / DT)):
        (now,) = step(shift(k * DT), now)
        places.append(now[0, 0])
    return np.array(places)


@pytest.mark.parametrize("ratio", [0.5, 0.8])
def test_below_critical_damping_a_step_is_overshot_as_by_an_oscillator(ratio: float):
    places = followed(path(damping_ratio=ratio), lambda _: 0.03, 4.0)
    assert places.max() / 0.03 - 1.0 == pytest.approx(np.exp(-np.pi * ratio / np.sqrt(1.0 - ratio**2)), abs=2e-3)


def test_above_critical_damping_a_step_is_followed_with_two_times():
    one = path(damping_ratio=1.4)
    spread = np.sqrt(1.4**2 - 1.0)
    slow, fast = (1.0 / (one.frequency * (1.4 - sign * spread)) for sign in (1.0, -1.0))
    t = DT * (1.0 + np.arange(round(2.0 / DT)))
    wanted = 0.03 * (1.0 - (slow * np.exp(-t / slow) - fast * np.exp(-t / fast)) / (slow - fast))
    np.testing.assert_allclose(followed(one, lambda _: 0.03, 2.0), wanted, atol=0.03 * 3e-3)


def test_a_steady_motion_is_followed_with_the_lag():
    places = followed(path(lag=0.3), lambda t: 0.01 * t, 5.0)
    assert 0.01 * 5.0 - places[-1] == pytest.approx(0.01 * 0.3, rel=5e-3)


def test_the_centre_of_a_twin_at_rest_is_on_its_path(rig):
    level = Disturbances.at_level(2, "unseen")
    twin = Twin(rig, draw_machine(rig, level, 0), draw_wearer(level, 0), 0)
    shifts = list(twin._scene.arms[0].shifts)
    assert len(shifts) == 2
    before = twin._scene.data.qpos[shifts].copy()
    for _ in range(100):
        state = twin.read()
        twin.write(Command(state.t, state.sequence, state.t + 0.1, np.zeros(4), state.current, np.full(4, 50.0)))
    np.testing.assert_allclose(twin._scene.data.qpos[shifts], before, atol=3e-4)  # the springs' give under the arm


def test_a_path_that_the_estimator_does_not_assume_is_no_truth():
    truth = parameter_truth(draw_wearer(Disturbances.at_level(2, "unseen"), 0))
    assert not any(name.startswith("glenohumeral") or name.endswith("stiffness") for name in truth)
