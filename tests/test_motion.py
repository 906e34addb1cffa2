"""Every reference motion is consistent: its velocity and acceleration are the derivatives of its position."""

import numpy as np
import pytest

from exograv.model.description import load_rig
from exograv.motion import Harmonics, Passage, Trajectory, eased_in, fourier, go_to, hold, joined, minimum_jerk, sweep

DT = 1e-3
START = np.array([0.1, -0.2, 0.3, 1.0])
GOAL = np.array([0.9, 0.4, -0.3, 1.5])
ENDS = slice(1, -1)  # Central differences need a neighbour on both sides.


def excitation() -> Trajectory:
    settings = load_rig("recupera_like").excitation
    centre, sine, cosine = (np.deg2rad(x) for x in (settings.centre_deg, settings.sine_deg, settings.cosine_deg))
    return fourier(centre, sine, cosine, settings.period_s, 20.0, DT)


SMOOTH = {
    "minimum jerk": minimum_jerk(START, GOAL, 2.0, DT),
    "go to": go_to(START, GOAL, 0.5, DT),
    "fourier": excitation(),
    "hold": hold(START, 1.0, DT),
}
TABLED = {"eased in": eased_in(excitation(), 2.0), "sweep": sweep(START, 3, 1.4, 0.2, DT)}
"""Motions from a table or with corners, which are accurate to first order in the period only."""


def differences(table: np.ndarray) -> np.ndarray:
    return (table[2:] - table[:-2]) / (2 * DT)


@pytest.mark.parametrize("name", SMOOTH)
def test_velocity_and_acceleration_are_derivatives(name: str):
    motion = SMOOTH[name]
    # Error of second-order differences at 1 ms, for motions with at most 400 rad/s³ and 1e4 rad/s⁴.
    np.testing.assert_allclose(motion.v[ENDS], differences(motion.q), atol=1e-4)
    np.testing.assert_allclose(motion.a[ENDS], differences(motion.v), atol=2e-3)


@pytest.mark.parametrize("name", TABLED)
def test_velocity_and_acceleration_of_a_tabled_motion_are_derivatives_to_one_period(name: str):
    motion = TABLED[name]
    worst_a = np.abs(motion.a).max()
    worst_jerk = np.abs(np.diff(motion.a, axis=0)).max() / DT
    np.testing.assert_allclose(motion.v[ENDS], differences(motion.q), atol=DT * worst_a)
    np.testing.assert_allclose(motion.a[ENDS], differences(motion.v), atol=DT * worst_jerk)


@pytest.mark.parametrize("seconds", [0.5, 1.2345, 2.0])
def test_minimum_jerk_goes_from_rest_to_rest(seconds: float):
    motion = minimum_jerk(START, GOAL, seconds, DT)
    np.testing.assert_allclose(motion.q[0], START, atol=1e-6)  # The first row is one tick after the start.
    np.testing.assert_allclose(motion.q[-1], GOAL, atol=1e-12)
    np.testing.assert_allclose(motion.v[-1], 0.0, atol=1e-12)
    np.testing.assert_allclose(motion.a[-1], 0.0, atol=1e-10)
    assert motion.seconds == pytest.approx(seconds, abs=DT)


@pytest.mark.parametrize("v_max", [0.2, 1.0, 100.0])
def test_no_joint_goes_faster_than_allowed(v_max: float):
    motion = go_to(START, GOAL, v_max, DT)
    assert np.abs(motion.v).max() <= v_max * (1 + 2 * DT)  # The duration is rounded to whole ticks.
    assert motion.seconds >= 0.5


@pytest.mark.parametrize("goal", [1.9, 0.2, 1.02, 1.0, 0.999])
def test_a_sweep_goes_there_and_back_and_no_further(goal: float):
    motion = sweep(START, 3, goal, 0.2, DT)
    moved = motion.q[:, 3]
    between = sorted([START[3], goal])
    one_tick = 0.2 * DT
    assert moved.min() >= between[0] - one_tick
    assert moved.max() <= between[1] + one_tick
    assert moved[len(moved) // 2] == pytest.approx(goal, abs=one_tick)
    assert moved[-1] == pytest.approx(START[3], abs=1e-9)
    np.testing.assert_array_equal(motion.q[:, :3], np.tile(START[:3], (len(motion), 1)))


def test_a_long_sweep_cruises_at_its_speed_in_both_directions():
    v = sweep(START, 3, 1.9, 0.2, DT).v[:, 3]
    assert np.mean(v == 0.2) == pytest.approx(np.mean(v == -0.2))
    assert np.mean(np.abs(v) == 0.2) > 0.8


def test_an_eased_in_motion_starts_from_rest_where_the_motion_starts():
    motion, eased = excitation(), eased_in(excitation(), 2.0)
    np.testing.assert_array_equal(eased.q[0], motion.q[0])
    np.testing.assert_array_equal(eased.v[0], 0.0)
    assert len(eased) == len(motion)


def test_an_eased_in_motion_keeps_to_the_path_and_lags_by_half_the_ramp():
    motion, eased = excitation(), eased_in(excitation(), 2.0)
    lag = 1000
    np.testing.assert_allclose(eased.q[2000:], motion.q[1000 : len(motion) - lag], atol=1e-9)
    np.testing.assert_allclose(eased.v[2000:], motion.v[1000 : len(motion) - lag], atol=1e-9)
    # The nearest point of the path is never farther away than half the motion in a tick.
    for q in eased.q[:2000:100]:
        assert np.linalg.norm(motion.q[:2000] - q, axis=1).min() < 0.5 * DT * np.linalg.norm(motion.v, axis=1).max()


def test_a_fourier_motion_repeats_after_its_period():
    settings = load_rig("recupera_like").excitation
    centre, sine, cosine = (np.deg2rad(x) for x in (settings.centre_deg, settings.sine_deg, settings.cosine_deg))
    motion = fourier(centre, sine, cosine, settings.period_s, 2 * settings.period_s, DT)
    ticks = round(settings.period_s / DT)
    np.testing.assert_allclose(motion.q[ticks:], motion.q[:ticks], atol=1e-9)
    np.testing.assert_allclose(motion.q[:ticks].mean(axis=0), centre, atol=1e-9)


def test_joined_motions_follow_each_other():
    way = joined([minimum_jerk(START, GOAL, 1.0, DT), hold(GOAL, 0.5, DT)])
    assert len(way) == 1500
    assert way.seconds == pytest.approx(1.5)
    np.testing.assert_array_equal(way.q[-1], GOAL)


def test_a_passage_is_the_same_motion_as_its_table():
    start, goal, dt = np.array([0.1, -0.4]), np.array([1.0, 0.2]), 2e-3
    passage = Passage.planned(start, goal, 0.6, 0.5, dt)
    table = joined([go_to(start, goal, 0.6, dt), hold(goal, 0.5, dt)])
    assert len(passage) == len(table)
    for k in range(len(table)):
        q, v, a = passage.at(k)
        np.testing.assert_allclose(q, table.q[k], rtol=0, atol=1e-15)
        np.testing.assert_allclose(v, table.v[k], rtol=0, atol=1e-14)
        np.testing.assert_allclose(a, table.a[k], rtol=0, atol=1e-12)


INTERPOLATED = 1e-5
"""Error of linear interpolation between the ticks of a table, relative to the largest value [-]: some 20 rad/s² · DT²
for a position, and the same for its derivatives."""


def test_harmonics_that_are_computed_tick_by_tick_are_those_of_their_table():
    settings = load_rig("recupera_like").excitation
    parts = settings.centre_deg, settings.sine_deg, settings.cosine_deg
    centre, sine, cosine = (np.deg2rad(part) for part in parts)
    path = Harmonics(centre, sine, cosine, settings.period_s, 10.0, 2.0, DT)
    table = path.table()
    assert len(path) == len(table) == round(10.0 / DT)
    q, v, a = (np.array(rows) for rows in zip(*map(path.at, range(len(path))), strict=True))
    for found, expected in ((q, table.q), (v, table.v), (a, table.a)):
        np.testing.assert_allclose(found, expected, atol=INTERPOLATED * np.abs(expected).max())
