"""Any coordinates describe a possible arm; they start at the given parameters and have the correct derivative."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from exograv.identification.core.coordinates import THETA_SD_MAX, Coordinates
from exograv.identification.core.sample_pace import SamplePace
from exograv.identification.core.square_root import square_root
from exograv.model.tree import inertial_parameters, is_physical

BODY = inertial_parameters(2.0, np.array([0.02, 0.0, -0.15]), 0.05 * np.eye(3))
X = np.concatenate([BODY, [0.5, -1.0]])
BASIS = np.vstack([np.zeros((10, 2)), [[2.0, 0.0], [1.0, 3.0]]])
COORDINATES = Coordinates((slice(0, 10),), X, BASIS)
STEP = 1e-6


def test_it_starts_where_it_is_told():
    np.testing.assert_allclose(COORDINATES.at(COORDINATES.start)[0], X, atol=1e-12)


@given(c=arrays(np.float64, 12, elements=st.floats(-2.0, 2.0)))
def test_any_coordinates_are_a_possible_body(c: np.ndarray):
    assert is_physical(COORDINATES.at(c)[0][:10])


def test_its_derivative_is_that_of_finite_differences():
    _, derivative = COORDINATES.at(COORDINATES.start)
    for i, unit in enumerate(np.eye(12)):
        up, down = (COORDINATES.at(COORDINATES.start + side * STEP * unit)[0] for side in (1.0, -1.0))
        np.testing.assert_allclose(derivative[:, i], (up - down) / (2 * STEP), atol=1e-7)


def test_the_prior_of_the_coordinates_is_that_of_the_parameters():
    covariance = np.zeros((12, 12))
    covariance[:10, :10] = np.diag((0.01 * np.abs(BODY) + 1e-5) ** 2)
    _, derivative = COORDINATES.at(COORDINATES.start)
    back = derivative @ COORDINATES.prior(covariance) @ derivative.T
    np.testing.assert_allclose(back[:10, :10], covariance[:10, :10], atol=1e-9)


def test_a_body_of_which_nothing_is_known_is_known_to_within_some_factor():
    covariance = np.zeros((12, 12))
    covariance[:10, :10] = 100.0 * np.eye(10)
    sd = np.sqrt(np.diag(COORDINATES.prior(covariance)))
    assert (sd[:10] <= THETA_SD_MAX + 1e-12).all()


def test_a_square_root_of_a_covariance_squares_to_it_whatever_its_units():
    rng = np.random.default_rng(0)
    scale = np.array([1e-4, 1.0, 1e3, 0.0])
    half = scale[:, None] * rng.standard_normal((4, 4))
    L = square_root(half @ half.T)
    np.testing.assert_allclose(L @ L.T, half @ half.T, atol=1e-9 * 1e6)
    assert L.shape == (4, 3)


def test_a_pace_takes_the_first_sample_and_then_one_in_each_period():
    pace = SamplePace(0.02)
    taken = [k for k in range(100) if pace.takes(0.001 * k)]
    assert taken[0] == 0
    # A sample may be early by a twentieth of the period.
    assert set(np.diff(taken)) <= {19, 20}
