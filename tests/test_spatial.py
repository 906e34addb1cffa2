"""Rotations, frames and small symmetric systems obey their laws."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.spatial import Transform, inertia_matrix, rotation_about, rotation_residual, skew, solve_symmetric

PARITY = 1e-12
SEEDS = st.integers(0, 100_000)
ANGLES = st.floats(-3.0, 3.0)


def numbers(expression: ca.SX) -> np.ndarray:
    return np.array(ca.evalf(expression))


def unit_axis(seed: int) -> np.ndarray:
    axis = np.random.default_rng(seed).normal(size=3)
    return axis / np.linalg.norm(axis)


def random_transform(seed: int) -> Transform:
    generator = np.random.default_rng(seed)
    R = rotation_about(ca.DM(unit_axis(seed)), ca.SX(generator.uniform(-3.0, 3.0)))
    return Transform(R, ca.SX(ca.DM(generator.normal(size=3))))


@given(seed=SEEDS)
def test_skew_is_the_cross_product(seed: int):
    w, u = np.random.default_rng(seed).normal(size=(2, 3))
    np.testing.assert_allclose(numbers(skew(ca.SX(ca.DM(w))) @ ca.DM(u)).ravel(), np.cross(w, u), atol=PARITY)


@given(seed=SEEDS, angle=ANGLES)
def test_a_rotation_is_orthogonal_right_handed_and_leaves_its_axis(seed: int, angle: float):
    axis = unit_axis(seed)
    R = numbers(rotation_about(ca.DM(axis), ca.SX(angle)))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=PARITY)
    assert np.linalg.det(R) == pytest.approx(1.0)
    np.testing.assert_allclose(R @ axis, axis, atol=PARITY)
    assert np.trace(R) == pytest.approx(1 + 2 * np.cos(angle))


@given(seed=SEEDS, one=ANGLES, other=ANGLES)
def test_rotations_about_one_axis_add(seed: int, one: float, other: float):
    axis = ca.DM(unit_axis(seed))
    both = rotation_about(axis, ca.SX(one)) @ rotation_about(axis, ca.SX(other))
    np.testing.assert_allclose(numbers(both), numbers(rotation_about(axis, ca.SX(one + other))), atol=PARITY)


def test_a_positive_angle_about_z_turns_x_towards_y():
    R = numbers(rotation_about(ca.DM([0.0, 0.0, 1.0]), ca.SX(np.pi / 2)))
    np.testing.assert_allclose(R @ [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], atol=PARITY)


@given(seed=SEEDS, angle=ANGLES)
def test_the_residual_is_the_axis_times_the_sine(seed: int, angle: float):
    axis = unit_axis(seed)
    residual = numbers(rotation_residual(rotation_about(ca.DM(axis), ca.SX(angle)))).ravel()
    np.testing.assert_allclose(residual, np.sin(angle) * axis, atol=PARITY)


@given(seed=SEEDS)
def test_a_pose_and_its_inverse_cancel(seed: int):
    T = random_transform(seed)
    both = T @ T.inverse()
    np.testing.assert_allclose(numbers(both.R), np.eye(3), atol=PARITY)
    np.testing.assert_allclose(numbers(both.p), 0.0, atol=PARITY)


@given(seed=SEEDS)
def test_a_product_of_poses_is_one_after_the_other(seed: int):
    T_a_b, T_b_c = random_transform(seed), random_transform(seed + 1)
    point = ca.SX(ca.DM(np.random.default_rng(seed).normal(size=3)))
    at_once, in_turn = (T_a_b @ T_b_c).apply(point), T_a_b.apply(T_b_c.apply(point))
    np.testing.assert_allclose(numbers(at_once), numbers(in_turn), atol=PARITY)


def test_the_inertia_stands_where_pinocchio_puts_it():
    phi = ca.SX(ca.DM(np.arange(1.0, 11.0)))
    np.testing.assert_array_equal(numbers(inertia_matrix(phi)), [[5, 6, 8], [6, 7, 9], [8, 9, 10]])


@given(seed=SEEDS, n=st.integers(1, 6))
def test_a_positive_definite_system_is_solved(seed: int, n: int):
    generator = np.random.default_rng(seed)
    root = generator.normal(size=(n, n))
    H, b = root @ root.T + np.eye(n), generator.normal(size=(n, 2))
    x, pivot = solve_symmetric(ca.SX(ca.DM(H)), ca.SX(ca.DM(b)), 1e-3)
    np.testing.assert_allclose(
        numbers(x), np.linalg.solve(H, b), atol=1e-9
    )  # The condition number is up to some hundred.
    assert 0.99 <= numbers(pivot).item() <= np.linalg.eigvalsh(H)[-1]


def test_a_singular_system_is_damped_and_says_so():
    H = np.array([[1.0, 1.0], [1.0, 1.0]])
    x, pivot = solve_symmetric(ca.SX(ca.DM(H)), ca.SX(ca.DM([1.0, 2.0])), 0.5)
    assert np.isfinite(numbers(x)).all()
    assert numbers(pivot).item() == 0.0


def test_a_nan_in_the_system_is_seen_in_the_solution():
    x, _ = solve_symmetric(ca.SX(ca.DM([[1.0, 0.2], [0.2, np.nan]])), ca.SX(ca.DM([1.0, 2.0])), 0.5)
    assert np.isnan(numbers(x)).any()
