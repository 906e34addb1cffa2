"""Any ten log-Cholesky coordinates describe a possible body, and every possible body has such coordinates."""

import casadi as ca
import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from exograv.identification.core.log_cholesky import phi_from_theta, theta_from_phi
from exograv.model.tree import inertial_parameters, is_physical, pseudo_inertia

THETA = ca.SX.sym("theta", 10)
PHI = ca.Function("phi", [THETA], [phi_from_theta(THETA)])
numbers = arrays(np.float64, 10, elements=st.floats(-2.0, 2.0))


def phi_of(theta: np.ndarray) -> np.ndarray:
    return np.asarray(PHI(theta)).ravel()


@given(theta=numbers)
def test_any_numbers_describe_a_possible_body(theta: np.ndarray):
    assert is_physical(phi_of(theta))


@given(theta=numbers)
def test_the_numbers_come_back_from_the_body(theta: np.ndarray):
    np.testing.assert_allclose(theta_from_phi(phi_of(theta)), theta, atol=1e-6)


@given(theta=numbers)
def test_the_pseudo_inertia_is_a_triangle_times_itself(theta: np.ndarray):
    # exp(2 (α + d1)) … : the determinant is the product of the squared diagonal, independent of the other entries.
    determinant = np.exp(8 * theta[0] + 2 * theta[1:4].sum())
    np.testing.assert_allclose(np.linalg.slogdet(pseudo_inertia(phi_of(theta)))[1], np.log(determinant), atol=1e-6)


def test_an_ordinary_forearm_survives_the_round_trip():
    phi = inertial_parameters(1.7, np.array([0.01, -0.005, -0.17]), np.diag([0.012, 0.013, 0.002]))
    np.testing.assert_allclose(phi_of(theta_from_phi(phi)), phi, rtol=1e-9, atol=1e-12)


def test_alpha_scales_the_whole_body():
    theta = np.linspace(-0.5, 0.4, 10)
    heavier = theta + np.eye(10)[0] * 0.5 * np.log(2.0)
    np.testing.assert_allclose(phi_of(heavier), 2.0 * phi_of(theta))
