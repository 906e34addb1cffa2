"""The guard's table gives the weight of a chain, exactly where the products can, and refuses invalid entries."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.safety.plausible import Features, LimbTable, PlausibleTable

WEIGHTS = np.array([20.0, 8.0])
"""Weights of two links of one metre, hanging in series on horizontal axes [N]."""
angles = st.floats(-np.pi, np.pi)


def pendulum(q: np.ndarray) -> np.ndarray:
    """Torque that carries a double pendulum whose links' centres are at half a metre [N·m]."""
    elbow = 0.5 * WEIGHTS[1] * np.sin(q.sum())
    return np.array([(0.5 * WEIGHTS[0] + WEIGHTS[1]) * np.sin(q[0]) + elbow, elbow])


def fitted() -> PlausibleTable:
    """Return the table of the pendulum as a machine, and of an arm of half its weight."""
    postures = np.random.default_rng(0).uniform(-np.pi, np.pi, (200, 2))
    features = Features(2, 2)
    F = np.array([features.of(q).copy() for q in postures])
    table = np.linalg.lstsq(F, np.array([pendulum(q) for q in postures]), rcond=None)[0].T
    chain = LimbTable((0, 1), 2, table, 0.5 * table)
    return PlausibleTable((chain,), np.zeros(2), np.ones(2), np.zeros(2))


TABLE = fitted()


@given(angles, angles, st.floats(0.0, 1.8))
def test_a_chain_s_weight_is_in_the_table_exactly(first: float, second: float, gravity_level: float):
    q = np.array([first, second])
    expected = (1.0 + 0.5 * (1.0 - gravity_level)) * pendulum(q)
    np.testing.assert_allclose(TABLE.torque(q, gravity_level), expected, atol=1e-9)


@given(angles, angles)
def test_above_one_gravity_the_arm_is_pushed_down(first: float, second: float):
    q = np.array([first, second])
    change = np.subtract(TABLE.torque(q, 1.8), TABLE.torque(q, 1.0))
    np.testing.assert_allclose(change, -0.4 * pendulum(q), atol=1e-9)


def test_two_limbs_keep_their_own_joints():
    chain = TABLE.chains[0]
    both = PlausibleTable((replace(chain, joints=(0, 2)), replace(chain, joints=(3, 1))), *[np.zeros(4)] * 3)
    q = np.array([0.3, -0.2, 0.5, 1.0])
    tau = np.array(both.torque(q, 1.0))
    np.testing.assert_allclose(tau[[0, 2]], pendulum(q[[0, 2]]), atol=1e-9)
    np.testing.assert_allclose(tau[[3, 1]], pendulum(q[[3, 1]]), atol=1e-9)


@pytest.mark.parametrize(("joints", "factors", "count"), [(1, 1, 3), (2, 2, 9), (4, 4, 81), (3, 1, 7), (7, 4, 939)])
def test_features_are_the_products_with_at_most_so_many_factors(joints: int, factors: int, count: int):
    features = Features(joints, factors)
    q = np.random.default_rng(joints).uniform(-3.0, 3.0, joints)
    chosen = [(k, name) for k in range(joints) for name in (np.cos, np.sin)]
    products = [
        np.prod([name(q[k]) for k, name in some])
        for size in range(factors + 1)
        for some in combinations(chosen, size)
        if len({k for k, _ in some}) == size
    ]
    assert features.count == count == len(products)
    np.testing.assert_allclose(np.sort(features.of(q)[features.kept]), np.sort(products), atol=1e-12)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"error": np.array([np.nan, 0.0])}, "error"),
        ({"dry": np.array([-1.0, 0.0])}, "dry"),
        ({"error": np.zeros(3), "dry": np.zeros(3), "viscous": np.zeros(3)}, "each of 3 once"),
        ({"chains": (replace(TABLE.chains[0], arm=np.full((2, 9), np.inf)),)}, "not finite"),
        ({"chains": (replace(TABLE.chains[0], exo=np.where(np.eye(2, 9), np.nan, 1.0)),)}, "not finite"),
    ],
)
def test_an_invalid_table_is_refused(change: dict, word: str):
    with pytest.raises(ConfigError, match=word):
        replace(TABLE, **change)
