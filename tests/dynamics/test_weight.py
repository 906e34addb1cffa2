"""The weight of a tree equals inverse dynamics at rest, and its stiffness is the symmetric derivative of the torque."""

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.dynamics.rnea import rnea
from exograv.dynamics.weight import weight
from exograv.model.kinematics import body_poses

PARITY = 1e-12
"""Tolerance relative to the largest entry: some hundred rounding errors."""


@pytest.mark.parametrize("name", ["exo", "arm"])
@pytest.mark.parametrize("seed", [1000, 1001, 1002])
def test_weight_is_inverse_dynamics_at_rest(assembly, name: str, seed: int):
    tree = assembly.exo if name == "exo" else assembly.arm.tree
    n = len(tree.joints)
    q, phi, gravity, still = ca.SX.sym("q", n), ca.SX.sym("phi", 10, n), ca.SX.sym("gravity", 3), ca.SX.zeros(n)
    at_rest = rnea(tree, q, still, still, phi, gravity)
    outputs = [*weight(tree, body_poses(tree, q), phi, gravity), at_rest, ca.jacobian(at_rest, q)]
    rng = np.random.default_rng(seed)
    values = rng.normal(size=n), rng.normal(size=(10, n)), rng.normal(size=3)
    torque, stiffness, expected, derivative = kernel.compile(ca.Function("weight", [q, phi, gravity], outputs)).of(
        *values
    )
    np.testing.assert_allclose(torque, expected, atol=PARITY * np.abs(expected).max())
    np.testing.assert_allclose(stiffness, derivative, atol=PARITY * np.abs(derivative).max())
    np.testing.assert_array_equal(stiffness, stiffness.T)
