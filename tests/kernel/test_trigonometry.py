"""Sine and cosine are right within one unit of the last place at each angle, and the same in each lane."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv import kernel
from exograv.kernel import native

ULP_MAX = 1.0
"""Largest error in units in the last place; the C library's own are within 0.55."""

LONG = np.finfo(np.longdouble).nmant > 60
"""True if this platform has a longer double to compare with; its sine reduces each angle exactly."""

LANES = [1, 2, 4, 8]


def both(lanes: int, x: np.ndarray) -> np.ndarray:
    """Return sine and cosine (2, size)."""
    angle = ca.SX.sym("x")
    function = ca.Function("both", [angle], [ca.vertcat(ca.sin(angle), ca.cos(angle))])
    if lanes > 1:
        return kernel.compile(function, lanes=lanes).of(x[None])[0]
    compiled = native.compile(function)
    return np.array([compiled.of(value)[0] for value in x]).T


def angles() -> np.ndarray:
    rng = np.random.default_rng(1001)
    near_turns = np.concatenate([(np.arange(-400, 400) * np.pi / 2), np.arange(10**5, 10**5 + 400) * np.pi / 2,
                                 np.arange(2**21 - 200, 2**21 + 200) * np.pi / 2])  # fmt: skip
    neighbours = [near_turns, np.nextafter(near_turns, np.inf), np.nextafter(near_turns, -np.inf)]
    sizes = np.exp(rng.uniform(np.log(1e-320), np.log(1.7e308), 2000)) * rng.choice([-1.0, 1.0], 2000)
    # Of all doubles, this one is closest to a multiple of π/2: 6381956970095103 · 2⁷⁹⁷ (Muller, Elementary Functions).
    hard = [6381956970095103.0 * 2.0**797, 2.0**20, np.nextafter(2.0**20, 0), np.nextafter(2.0**20, 1e9), 1.7e308]
    return np.concatenate([rng.uniform(-10, 10, 4000), *neighbours, sizes, hard, np.negative(hard)])


@pytest.mark.skipif(not LONG, reason="needs a long double of 64 bits to compare with")
def test_both_are_within_one_unit_of_the_last_place():
    x = angles()
    got = both(8, x)
    exact = np.array([np.sin(x.astype(np.longdouble)), np.cos(x.astype(np.longdouble))])
    ulp = np.maximum(np.spacing(np.abs(exact.astype(float))), 5e-324)
    error = np.abs((got.astype(np.longdouble) - exact) / ulp)
    assert error.max() < ULP_MAX, (x[error.max(axis=0).argmax()], error.max())


@pytest.mark.parametrize("lanes", LANES[1:])
def test_every_lane_has_the_bits_of_a_single_state_whatever_its_neighbours_are(lanes: int):
    x = np.random.default_rng(1002).permutation(angles())[:1003]
    x[::17], x[5::29] = np.nan, np.inf
    np.testing.assert_array_equal(both(lanes, x), both(1, x))


@pytest.mark.parametrize("lanes", LANES)
def test_zero_keeps_its_sign_and_a_non_finite_angle_gives_nan(lanes: int):
    sine, cosine = both(lanes, np.array([0.0, -0.0, np.inf, -np.inf, np.nan]))
    np.testing.assert_array_equal(sine, [0.0, -0.0, np.nan, np.nan, np.nan])
    np.testing.assert_array_equal(np.signbit(sine[:2]), [False, True])
    np.testing.assert_array_equal(cosine, [1.0, 1.0, np.nan, np.nan, np.nan])


@given(x=st.floats(allow_nan=False, allow_infinity=False))
def test_they_lie_on_the_unit_circle_and_are_odd_and_even(x: float):
    sine, cosine = both(1, np.array([x, -x]))
    assert sine[0] ** 2 + cosine[0] ** 2 == pytest.approx(1.0, abs=4e-16)
    assert sine[0] == -sine[1]
    assert cosine[0] == cosine[1]


def test_a_sine_without_its_cosine_and_two_sines_of_one_angle_are_right():
    x = ca.SX.sym("x", 2)
    total = x[0] + x[1]
    function = ca.Function("few", [x], [ca.vertcat(ca.sin(x[0]), ca.cos(total), ca.sin(total), ca.cos(total) + 1)])
    (got,) = native.compile(function).of([0.3, 0.4])
    np.testing.assert_allclose(got, [np.sin(0.3), np.cos(0.7), np.sin(0.7), np.cos(0.7) + 1], rtol=4e-16)
