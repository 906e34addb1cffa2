"""The considered fields have the requested size and length, and are independent between joints."""

import numpy as np
import pytest

from exograv.identification.core.discrepancy import Discrepancy

SD = np.array([0.3, 0.05, 0.2, 0.1])
LENGTH_RAD = 0.5
FIELD = Discrepancy(SD, LENGTH_RAD, features=2000)  # many, so that a law of large numbers can be tested
MONTE_CARLO = 0.05  # of the correlation, for 2000 features: about two times 1/√2000


STILL, FORTH = np.zeros(4), np.array([0.5, -0.7, 0.6, -0.5])  # far beyond the speed at which friction turns


def covariance(q: np.ndarray, other: np.ndarray, v: np.ndarray = STILL, other_v: np.ndarray = STILL) -> np.ndarray:
    """Covariance of the fields' values at two postures and speeds (joint, joint) [(N·m)²]."""
    return FIELD.errors(q, v) @ FIELD.errors(other, other_v).T


@pytest.mark.parametrize("seed", range(5))
def test_at_every_posture_the_field_is_as_large_as_stated(seed: int):
    q = np.random.default_rng(seed).uniform(-1.5, 1.5, 4)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance(q, q))), SD, rtol=MONTE_CARLO)


@pytest.mark.parametrize("distance", [0.1, 0.5, 1.0, 2.0])
def test_two_postures_share_their_error_as_a_gaussian_of_their_distance(distance: float):
    direction = np.array([0.5, -0.5, 0.5, 0.5])
    q = np.array([0.8, 0.2, -0.1, 1.0])
    shared = np.diag(covariance(q, q + distance * direction)) / SD**2
    np.testing.assert_allclose(shared, np.exp(-0.5 * (distance / LENGTH_RAD) ** 2), atol=MONTE_CARLO)


def test_two_opposite_passes_err_in_their_mean_by_one_field_and_in_half_their_difference_by_the_other():
    q = np.array([0.8, 0.2, -0.1, 1.0])
    there, back = FIELD.errors(q, FORTH), FIELD.errors(q, -FORTH)
    for share in (0.5 * (there + back), 0.5 * (there - back)):
        np.testing.assert_allclose(np.sqrt(np.diag(share @ share.T)), SD, rtol=MONTE_CARLO)
    np.testing.assert_allclose(covariance(q, q, FORTH, -FORTH), 0.0, atol=2 * MONTE_CARLO * SD.max() ** 2)


def test_an_error_of_one_joint_says_nothing_of_another():
    q = np.array([0.8, 0.2, -0.1, 1.0])
    between = covariance(q, q, FORTH, FORTH)
    np.testing.assert_array_equal(between - np.diag(np.diag(between)), 0.0)


def test_the_field_belongs_to_the_method_and_not_to_the_data():
    q = np.ones(4)
    one, other = Discrepancy(SD, 0.5, 16), Discrepancy(SD, 0.5, 16)
    np.testing.assert_array_equal(one.errors(q, FORTH), other.errors(q, FORTH))
    assert one.count == 2 * 16 * 4 == one.errors(q, FORTH).shape[1]


def test_the_errors_of_a_joint_are_its_part_of_all_errors():
    q = np.array([0.1, -0.4, 0.7, 1.0])
    whole = FIELD.errors(q, FORTH).reshape(4, 4, FIELD.count_of_joint)
    np.testing.assert_array_equal(whole[range(4), range(4)], FIELD.errors_of_joint(q, FORTH))
    assert FIELD.count == 4 * FIELD.count_of_joint
