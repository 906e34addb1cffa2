"""The guard's table gives the weight of a chain, exactly where the products can, and refuses invalid entries."""

import math
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


@pytest.mark.parametrize(("joints", "factors"), [(1, 1), (3, 2), (4, 4)])
def test_slopes_are_the_derivatives_of_the_products_by_one_angle(joints: int, factors: int):
    features, step = Features(joints, factors), 1e-5
    q = np.random.default_rng(joints).uniform(-3.0, 3.0, joints)

    def products_at(q: np.ndarray) -> np.ndarray:
        return features.of(q)[features.kept].copy()

    for j in range(joints):
        there = step * (np.arange(joints) == j)
        differences = (products_at(q + there) - products_at(q - there)) / (2.0 * step)
        places, slopes = features.slopes(j, products_at(q)[None])
        expected = np.zeros(features.count)
        expected[places] = slopes[0]
        np.testing.assert_allclose(expected, differences, atol=1e-8)
        assert np.count_nonzero(differences) == len(places)


def sum_of(numbers: np.ndarray, features: Features, q: np.ndarray) -> float:
    """Sum of products at a posture [rad]."""
    return float(numbers @ features.of(q)[features.kept])


@pytest.mark.parametrize(("joints", "most", "further"), [(2, 1, 2), (3, 1, 3), (4, 2, 4), (5, 2, 4), (3, 2, 4)])
def test_each_joint_carries_the_slope_of_the_potential_beside_its_own_sum(joints: int, most: int, further: int):
    rng, step = np.random.default_rng(joints), 1e-6
    in_row, in_potential = Features(joints, most), Features(joints, further, most + 1)
    exo, arm = rng.normal(size=(2, joints, in_row.count))
    potential = rng.normal(size=(2, in_potential.count))
    chain = LimbTable(tuple(reversed(range(joints))), most, exo, arm, further, potential)
    table = PlausibleTable((chain,), *[np.zeros(joints)] * 3)
    for gravity_level in (0.3, 1.0):
        q = rng.uniform(-3.0, 3.0, joints)
        rows, whole = exo + (1.0 - gravity_level) * arm, potential[0] + (1.0 - gravity_level) * potential[1]
        own = [sum_of(row, in_row, q) for row in rows]
        ways = step * np.eye(joints)
        slopes = [sum_of(whole, in_potential, q + way) - sum_of(whole, in_potential, q - way) for way in ways]
        found = table.torque(q[::-1], gravity_level)[::-1]
        np.testing.assert_allclose(found, np.add(own, np.array(slopes) / (2.0 * step)), atol=1e-7)


def torque_of_version_0_1(chain: LimbTable, q: np.ndarray, gravity_level: float) -> list[float]:
    """Torque of a table without a potential, summed in the order of version 0.1, whose recordings are replayed."""
    joints = len(chain.joints)
    level, ordered = [(-1, 0, 1.0)], [(0, 1.0)]  # last joint, place in `Features`, and product
    for _ in range(min(joints, chain.most_factors)):
        level = [
            (j, place + digit * 3**j, product * function(q[j]))
            for j in range(joints)
            for digit, function in ((1, math.cos), (2, math.sin))
            for last, place, product in level
            if last < j
        ]
        ordered += [(place, product) for _, place, product in level]
    kept, torque = Features(joints, chain.most_factors).kept.tolist(), list[float]()
    for exo, arm in zip(chain.exo.tolist(), chain.arm.tolist(), strict=True):
        sums = [0.0] * 8
        for k, (place, product) in enumerate(ordered):
            at = kept.index(place)
            sums[k % 8] += (exo[at] + (1.0 - gravity_level) * arm[at]) * product
        a, b, c, d, e, f, g, h = sums
        torque.append(((a + e) + (c + g)) + ((b + f) + (d + h)))
    return torque


@pytest.mark.parametrize(("joints", "most"), [(1, 1), (2, 1), (3, 3), (4, 4), (5, 4), (7, 2)])
def test_a_table_of_version_0_1_gives_the_same_torque_to_the_last_bit(joints: int, most: int):
    rng = np.random.default_rng(most)
    chain = LimbTable(tuple(range(joints)), most, *rng.normal(size=(2, joints, Features(joints, most).count)))
    table = PlausibleTable((chain,), *[np.zeros(joints)] * 3)
    for gravity_level in (0.0, 0.4):
        q = rng.uniform(-3.0, 3.0, joints)
        assert table.torque(q, gravity_level) == torque_of_version_0_1(chain, q, gravity_level)


def test_a_limb_without_factors_carries_the_same_torque_in_all_postures():
    exo, arm = np.array([[1.0], [2.0], [3.0], [4.0]]), np.full((4, 1), 2.0)
    table = PlausibleTable((LimbTable((0, 1, 2, 3), 0, exo, arm),), *[np.zeros(4)] * 3)
    for q in (np.zeros(4), np.array([1.0, -2.0, 0.5, 3.0])):
        assert table.torque(q, 0.5) == [2.0, 3.0, 4.0, 5.0]


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"error": np.array([np.nan, 0.0])}, "error"),
        ({"dry": np.array([-1.0, 0.0])}, "dry"),
        ({"viscous": np.array([np.inf, 0.0])}, "viscous"),
        ({"error": np.zeros(3), "dry": np.zeros(3), "viscous": np.zeros(3)}, "each of 3 once"),
        ({"chains": (replace(TABLE.chains[0], arm=np.full((2, 9), np.inf)),)}, "not finite"),
        ({"chains": (replace(TABLE.chains[0], exo=np.where(np.eye(2, 9), np.nan, 1.0)),)}, "not finite"),
        ({"chains": (replace(TABLE.chains[0], potential=np.full((2, 4), np.nan)),)}, "not finite"),
    ],
)
def test_an_invalid_table_is_refused(change: dict, word: str):
    with pytest.raises(ConfigError, match=word):
        replace(TABLE, **change)
