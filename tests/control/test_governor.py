"""A path waits for an arm that is off it, goes on when the arm has come, and is the same path all the while."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv import motion
from exograv.control.governor import LAG_S, PATIENCE_S, PATIENCE_SHARE, SLOWS_NM, STANDS_NM, Governor, rate_at

DT = 0.001
PATH = motion.minimum_jerk(np.array([0.0, 1.0]), np.array([1.2, 0.2]), 3.0, DT)
KP = np.array([80.0, 40.0])
ON_IT = np.zeros(2)
FAR_OFF = np.array([0.0, 1.1 * STANDS_NM]) / KP

DIFFERENCE = 5e-3
"""What a difference quotient of the table's positions over two ticks leaves, as a share of the largest [-]."""


def on_path(governor: Governor) -> np.ndarray:
    """Where the arm should be: an arm that is there is asked for nothing else."""
    ticks = np.arange(len(PATH))
    return np.array([np.interp(governor.at, ticks, column) for column in PATH.q.T])


def pass_time(governor: Governor, off: np.ndarray, ticks: int = 1) -> None:
    """With an arm that is so far off [rad]."""
    governor.reference(PATH, on_path(governor) - off)
    governor.step(ticks)


def asked(off_at: dict[int, np.ndarray], ticks: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, Governor]:
    """The path's position, velocity and acceleration in each tick; the arm is so far off from the ticks on."""
    governor, off, rows = Governor(KP, DT), ON_IT, []
    for k in range(ticks):
        off = off_at.get(k, off)
        where = on_path(governor)
        reference = governor.reference(PATH, where - off)
        rows.append((where, reference.v, reference.a))
        governor.step()
    q, v, a = (np.array(column) for column in zip(*rows, strict=True))
    return q, v, a, governor


def test_an_arm_on_its_path_is_asked_for_the_path_to_the_bit():
    q, v, a, governor = asked({0: np.array([-0.99, 0.99]) * SLOWS_NM / KP}, len(PATH))
    assert np.array_equal(q, PATH.q)
    assert np.array_equal(v, PATH.v)
    assert np.array_equal(a, PATH.a)
    assert governor.waited_s == 0.0


def test_the_path_waits_for_an_arm_that_is_held_and_then_goes_on_to_its_end():
    q, v, a, _ = asked({1000: FAR_OFF, 4000: ON_IT}, 7500)
    assert np.abs(np.diff(q[2500:4000], axis=0)).max() < 1e-9
    assert np.abs(v[2500:4000]).max() < 1e-6
    assert np.abs(a[2500:4000]).max() < 1e-4
    np.testing.assert_allclose(q[-1], PATH.q[-1])


def test_what_is_asked_for_stays_on_the_path_while_it_waits():
    q, *_ = asked({1000: FAR_OFF, 2000: ON_IT}, 4500)
    assert (np.diff(q[:, 0]) >= 0.0).all()
    along = (q[:, 0] - PATH.q[0, 0]) / (PATH.q[-1, 0] - PATH.q[0, 0])
    np.testing.assert_allclose(q[:, 1], PATH.q[0, 1] + along * (PATH.q[-1, 1] - PATH.q[0, 1]), atol=1e-9)


def test_velocity_and_acceleration_are_those_of_the_position_while_it_waits():
    q, v, a, _ = asked({800: FAR_OFF, 1300: ON_IT, 1700: 0.8 * FAR_OFF, 2300: ON_IT}, 5000)
    v_found, a_found = np.gradient(q, DT, axis=0), np.gradient(v, DT, axis=0)
    assert np.abs(v_found - v)[1:-1].max() < DIFFERENCE * np.abs(v).max()
    # Where the arm jumps off the path the second lag's slope has a corner; one tick of it.
    assert np.abs(a_found - a)[1:-1].max() < 0.5 / LAG_S**2 * DT * np.abs(v).max() + DIFFERENCE * np.abs(a).max()


@given(offs=st.lists(st.floats(0.0, 0.6), min_size=1, max_size=30))
def test_the_rate_stays_between_standing_and_the_clock_and_never_changes_abruptly(offs: list[float]):
    governor = Governor(KP, DT)
    for off in offs:
        for _ in range(20):
            before = governor.rate
            pass_time(governor, np.array([off, 0.0]))
            assert 0.0 <= governor.rate <= 1.0
            assert abs(governor.rate - before) <= DT / (np.e * LAG_S) * 1.02


@given(tau=st.floats(0.01, 100.0))
def test_only_a_joint_that_is_far_off_slows_a_path_whichever_it_is_and_to_whichever_side(tau: float):
    rate = rate_at(np.array([tau, 0.0, 0.0]))
    assert rate == rate_at(np.array([0.01, 0.0, -tau]))
    assert (rate == 1.0) if tau <= SLOWS_NM else (rate < 1.0)
    assert (rate == 0.0) if tau >= STANDS_NM else (rate > 0.0)


@pytest.mark.parametrize("off", [FAR_OFF, 0.85 * FAR_OFF])
def test_a_path_whose_arm_never_comes_is_given_up(off: np.ndarray):
    governor, ticks = Governor(KP, DT), 0
    while not governor.gives_up and ticks < 200_000:
        pass_time(governor, off)
        ticks += 1
    at_most = PATIENCE_S / (1.0 - (1.0 + PATIENCE_SHARE) * rate_at(KP * off))
    assert PATIENCE_S < ticks * DT < at_most + 1.0


def test_an_arm_that_is_held_now_and_then_is_not_given_up():
    governor = Governor(KP, DT)
    for k in range(60_000):
        pass_time(governor, FAR_OFF if k % 12_000 < 3_000 else ON_IT)
        assert not governor.gives_up


def test_ticks_that_nobody_saw_pass_as_if_they_had_been():
    one, other = Governor(KP, DT), Governor(KP, DT)
    for _ in range(30):
        pass_time(one, FAR_OFF)
    for _ in range(3):
        pass_time(other, FAR_OFF, 10)
    assert one.at == other.at
    assert one.slope == other.slope


@given(off=st.floats(-1.0, 1.0))
def test_feedback_is_never_made_to_ask_for_more_than_a_standing_path(off: float):
    q = PATH.q[0] - np.array([off, 0.0])
    asked_for = Governor(KP, DT).reference(PATH, q).q
    assert np.abs(KP * (asked_for - q)).max() <= STANDS_NM * (1.0 + 1e-9)
    if abs(off) * KP[0] < STANDS_NM:
        assert np.array_equal(asked_for, PATH.q[0])
