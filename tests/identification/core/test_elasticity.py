"""The two exponentials are monotone, start as the spring that they replace, and have correct derivatives."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from exograv.identification.core.elasticity import DoubleExponential

CURVES = DoubleExponential(2)
STIFFNESS, NEUTRAL = np.array([1.8, 0.6]), np.array([0.4, 1.9])
P = CURVES.start(STIFFNESS, STIFFNESS * NEUTRAL)
STEP = 1e-6
angle = st.floats(-2.0, 2.0)


def test_at_the_neutral_angle_it_is_the_spring_that_it_replaces():
    stiffness, offset = CURVES.tangent(P, NEUTRAL)
    np.testing.assert_allclose(stiffness, STIFFNESS)
    np.testing.assert_allclose(offset, STIFFNESS * NEUTRAL)
    np.testing.assert_allclose(CURVES.torque(P, NEUTRAL), 0.0, atol=1e-12)


@given(first=angle, second=angle)
def test_it_grows_with_the_angle(first: float, second: float):
    lower, upper = sorted((first, second))
    low, high = (CURVES.torque(P, np.full(2, z)) for z in (lower, upper))
    assert (high >= low).all()


@given(z=angle)
def test_the_tangent_touches(z: float):
    at = np.full(2, z)
    stiffness, offset = CURVES.tangent(P, at)
    np.testing.assert_allclose(stiffness * at - offset, CURVES.torque(P, at), atol=1e-9)
    slope = (CURVES.torque(P, at + STEP) - CURVES.torque(P, at - STEP)) / (2 * STEP)
    np.testing.assert_allclose(stiffness, slope, rtol=1e-6)


def test_its_derivative_is_that_of_finite_differences():
    z, numbers = np.array([0.3, -0.7]), P + 0.1
    columns = []
    for unit in np.eye(10):
        up, down = (CURVES.torque(numbers + side * STEP * unit, z) for side in (1.0, -1.0))
        columns.append((up - down) / (2 * STEP))
    np.testing.assert_allclose(CURVES.by_numbers(numbers, z), np.column_stack(columns), atol=1e-7)


def test_lines_near_the_curves_are_the_curves_where_these_are_straight():
    small = NEUTRAL + 1e-3 * np.random.default_rng(0).standard_normal((50, 2))
    stiffness, offset = CURVES.straightened(P, small)
    np.testing.assert_allclose(stiffness, STIFFNESS, rtol=1e-4)
    np.testing.assert_allclose(offset, STIFFNESS * NEUTRAL, rtol=1e-4)
