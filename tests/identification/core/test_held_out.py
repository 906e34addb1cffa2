"""The check at unused postures refuses a wrong estimate, and rarely a right one."""

import numpy as np
import pytest

from exograv.identification.core.held_out import FALSE_REJECTIONS, Residuals, agreement, nearest

FIT, HELD, DT_S, NOISE_NM = 600, 125, 0.08, 0.05
ERROR_NM = 0.1
"""Standard deviation of the estimate's own error, the same at all postures [N·m]."""


def slow(size_Nm: float, time_s: float, random: np.random.Generator) -> np.ndarray:
    """Return an Ornstein–Uhlenbeck process."""
    keep, torque = np.exp(-DT_S / time_s), size_Nm * random.standard_normal(FIT + HELD)
    for k in range(1, len(torque)):
        torque[k] = keep * torque[k - 1] + np.sqrt(1 - keep**2) * torque[k]
    return torque


def residuals(
    random: np.random.Generator, wrong_Nm: float = 0.0, size_Nm: float = 0.2, time_s: float = 3.0
) -> Residuals:
    """Return residuals of a wearer with this slow torque; the estimate is wrong by so much in the check."""
    torque = slow(size_Nm, time_s, random) + NOISE_NM * random.standard_normal(FIT + HELD)
    torque[FIT:] += wrong_Nm + ERROR_NM * random.standard_normal()
    visited = np.array([0, 1, 2, 3, 1, 3, 0, 2]).repeat(HELD // 8 + 1)[:HELD]
    noise, expected = np.full(FIT + HELD, NOISE_NM), np.full((HELD, HELD), ERROR_NM**2)
    return Residuals(np.full(FIT + HELD, DT_S), torque, noise, 0.3, expected, visited)


@pytest.mark.parametrize("time_s", [1.5, pytest.param(5.0, marks=pytest.mark.long)])
def test_about_one_in_a_hundred_right_estimates_is_refused(time_s: float):
    random = np.random.default_rng(0)
    refused = sum(not agreement([residuals(random, time_s=time_s)]).holds for _ in range(150))
    # 150 checks at 1 %: more than six refusals have a probability of 0.1 %.
    assert refused <= 6
    assert FALSE_REJECTIONS == 0.01


def test_an_error_far_above_the_wearers_slow_torque_is_refused():
    random = np.random.default_rng(1)
    assert sum(not agreement([residuals(random, wrong_Nm=1.2)]).holds for _ in range(20)) >= 18


def test_the_same_error_is_not_refused_with_a_wearer_who_pushes_as_much():
    random = np.random.default_rng(2)
    assert sum(not agreement([residuals(random, 1.2, size_Nm=1.0)]).holds for _ in range(20)) <= 4


def test_one_wrong_joint_is_enough_and_is_the_one_with_the_smallest_probability():
    random = np.random.default_rng(3)
    found = agreement([residuals(random), residuals(random, wrong_Nm=2.0), residuals(random)])
    assert not found.holds
    assert found.p.argmin() == 1
    assert found.residual[1] > 1.5
    assert (found.expected > ERROR_NM).all()


def test_a_sample_belongs_to_the_posture_whose_farthest_joint_is_nearest():
    postures = np.array([[0.0, 0.0], [1.0, 1.0]])
    assert nearest(np.array([[0.1, 0.4], [0.6, 0.6], [0.9, 0.0]]), postures).tolist() == [0, 1, 0]
