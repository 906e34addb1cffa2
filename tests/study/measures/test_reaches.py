"""Each touch has its own reach, on even or uneven samples, and none if a long stretch is missing."""

import numpy as np
import pytest

from exograv.study.measures.movement import log_dimensionless_jerk
from exograv.study.measures.reaches import Motion, reaches, scatter_about_mean

from .test_movement import least_jerk

REACH_S, CYCLE_S = 0.6, 2.5


def cycles(n: int, rate_Hz: float = 1000.0, distance: float = 1.0) -> tuple[Motion, list[float]]:
    """Return a motion to the target and back `n` times, in two joints, and the times at the target."""
    t = np.arange(0.0, n * CYCLE_S, 1.0 / rate_Hz)
    s, _ = least_jerk(REACH_S)
    since = t % CYCLE_S
    there = np.interp(since, 1.0 + REACH_S * np.linspace(0.0, 1.0, len(s)), s)
    back = np.interp(since, 1.7 + REACH_S * np.linspace(0.0, 1.0, len(s)), s)
    path = distance * (there - back)[:, None] * (0.6, 0.8)
    return Motion(t, path), [k * CYCLE_S + 1.0 + REACH_S for k in range(n)]


def test_each_touch_has_its_own_reach_of_the_length_and_time_that_it_took():
    motion, touches = cycles(4, distance=0.5)
    found = [reach for reach in reaches(motion, 0.0, touches) if reach is not None]
    assert len(found) == 4
    speed = least_jerk(REACH_S)[1]
    from_onset = log_dimensionless_jerk(speed[np.argmax(speed > 0.05 * speed.max()) :, None], 1000.0)
    for reach in found:
        # The reach is measured from 5 % of the peak speed, and smoothing rounds the corner at its end.
        assert reach.movement_s == pytest.approx(REACH_S, rel=0.1)
        assert reach.length == pytest.approx(0.5, rel=0.01)
        assert reach.peak_speed == pytest.approx(1.875 * 0.5 / REACH_S, rel=0.02)
        assert reach.ldlj == pytest.approx(from_onset, abs=0.3)


def test_twenty_samples_a_second_tell_time_and_length_of_a_reach():
    motion, touches = cycles(3, rate_Hz=20.0)
    found = [reach for reach in reaches(motion, 0.0, touches) if reach is not None]
    assert len(found) == 3
    for reach in found:
        assert reach.movement_s == pytest.approx(REACH_S, abs=0.06)
        assert reach.length == pytest.approx(1.0, rel=0.05)


def test_a_reach_of_which_a_quarter_second_is_missing_is_not_measured():
    motion, touches = cycles(2)
    kept = (motion.t < 1.2) | (motion.t > 1.45)
    found = list(reaches(Motion(motion.t[kept], motion.path[kept]), 0.0, touches))
    assert found[0] is None
    assert found[1] is not None


def test_one_lost_sample_changes_nothing_that_counts():
    motion, touches = cycles(1)
    kept = np.arange(len(motion.t)) != 1300
    (whole,), (less,) = (
        list(reaches(each, 0.0, touches)) for each in (motion, Motion(motion.t[kept], motion.path[kept]))
    )
    assert whole is not None
    assert less is not None
    assert less.ldlj == pytest.approx(whole.ldlj, abs=0.01)


def test_equal_reaches_have_no_scatter_and_ends_apart_have_theirs():
    one = np.linspace(0.0, 1.0, 101)[:, None] * np.array([0.0, 1.0])
    assert scatter_about_mean(np.array([one] * 5)) == pytest.approx((0.0, 0.0))
    ends = np.array([-0.1, 0.0, 0.1])
    end, course = scatter_about_mean(np.array([one * (1.0 + e) for e in ends]))
    assert end == pytest.approx(np.std(ends, ddof=1))
    assert 0.0 < course < end


def test_of_two_reaches_no_scatter_is_told():
    assert np.isnan(scatter_about_mean(np.zeros((2, 101, 4)))).all()
