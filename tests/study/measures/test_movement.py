"""A reach is found without the way back; its length, speed and smoothness are those of the law of motion."""

import numpy as np
import pytest

from exograv.study.measures.movement import last_reach, log_dimensionless_jerk, path_length, sparc

RATE_HZ = 1000.0
LEAST_JERK_LDLJ = -float(np.log(720.0 / 1.875**2))


def least_jerk(duration_s: float, distance: float = 1.0, rate_Hz: float = RATE_HZ) -> tuple[np.ndarray, np.ndarray]:
    """Return position and speed of the minimum-jerk movement from rest to rest."""
    s = np.arange(0.0, 1.0 + 1e-9, 1.0 / (rate_Hz * duration_s))
    position = distance * (10 * s**3 - 15 * s**4 + 6 * s**5)
    return position, distance / duration_s * (30 * s**2 - 60 * s**3 + 30 * s**4)


def out_and_in(rest_s: float = 1.0) -> tuple[np.ndarray, np.ndarray, int]:
    """Return the way back from the target, rest, a smooth reach, and the sample at which the reach begins."""
    x, v = least_jerk(0.8)
    still = np.zeros(int(rest_s * RATE_HZ))
    path = np.concatenate([1.0 - x, still, x])
    return np.column_stack([path, np.zeros_like(path)]), np.concatenate([v, still, v]), len(x) + len(still)


def test_the_way_back_and_the_rest_are_no_part_of_the_reach():
    path, speed, start = out_and_in()
    reach = last_reach(path, speed)
    assert reach is not None
    # The speed passes 5 % of its peak after 7 % of the movement.
    assert start < reach.first < start + 0.08 * 800
    assert reach.last == len(path) - 1


def test_a_correction_on_the_way_belongs_to_the_reach():
    first, v_first = least_jerk(0.6, 0.7)
    second, v_second = least_jerk(0.4, 0.3)
    still = np.zeros(500)
    path = np.concatenate([still, first, np.full(100, 0.7), 0.7 + second])[:, None]
    reach = last_reach(path, np.concatenate([still, v_first, np.zeros(100), v_second]))
    assert reach is not None
    assert reach.first < 600


def test_nothing_moves_no_reach():
    assert last_reach(np.ones((50, 3)), np.zeros(50)) is None


def test_a_straight_path_is_as_long_as_its_ends_are_apart_and_a_half_circle_longer():
    line = np.linspace(0.0, 1.0, 50)[:, None] * (3.0, 4.0)
    assert path_length(line) == pytest.approx(5.0)
    angle = np.linspace(0.0, np.pi, 1000)
    assert path_length(np.column_stack([np.cos(angle), np.sin(angle)])) == pytest.approx(np.pi, rel=1e-5)


@pytest.mark.parametrize("duration_s", [0.5, 1.0, 2.0])
@pytest.mark.parametrize("distance", [0.1, 10.0])
def test_least_jerk_has_its_dimensionless_jerk_at_any_size_and_speed(duration_s: float, distance: float):
    _, v = least_jerk(duration_s, distance)
    velocity = v[:, None] * (0.6, 0.8)
    # Differences omit the ends of the integral: half a percent at 500 samples.
    assert log_dimensionless_jerk(velocity, RATE_HZ) == pytest.approx(LEAST_JERK_LDLJ, abs=0.03)


def test_two_strokes_are_less_smooth_than_one_by_either_measure():
    _, one = least_jerk(1.0)
    _, half = least_jerk(0.5)
    two = np.concatenate([half, half])
    assert sparc(two, RATE_HZ) < sparc(one, RATE_HZ) - 0.2
    assert log_dimensionless_jerk(two[:, None], RATE_HZ) < log_dimensionless_jerk(one[:, None], RATE_HZ) - 1.0


def test_spectral_arc_length_does_not_know_the_size_and_hardly_the_duration():
    lengths = [sparc(size * least_jerk(duration_s)[1], RATE_HZ) for size, duration_s in ((1, 0.6), (9, 0.6), (1, 1.2))]
    assert lengths[1] == pytest.approx(lengths[0])
    assert lengths[2] == pytest.approx(lengths[0], abs=0.05)


def test_twenty_samples_a_second_tell_the_arc_length_of_a_whole_stroke():
    coarse = sparc(least_jerk(0.8, rate_Hz=20.0)[1], 20.0)
    assert coarse == pytest.approx(sparc(least_jerk(0.8)[1], RATE_HZ), abs=0.1)


def test_who_does_not_move_has_no_smoothness():
    assert np.isnan(sparc(np.zeros(100), RATE_HZ))
    assert np.isnan(log_dimensionless_jerk(np.zeros((100, 2)), RATE_HZ))
