"""Inverse dynamics of a tree conserves energy, and gravity equals an acceleration of its base."""

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.model.kinematics import body_poses
from exograv.model.tree import Tree, inertial_parameters

POWER_TOLERANCE = 1e-9  # W: rounding of powers of some hundred W
TORQUE_TOLERANCE = 1e-10  # N·m: rounding


def bodies(tree: Tree, seed: int) -> np.ndarray:
    generator = np.random.default_rng(seed)
    inertia = 0.01 * np.diag([1.0, 1.2, 0.7])
    return np.array(
        [inertial_parameters(generator.uniform(0.5, 2.0), generator.normal(0, 0.1, 3), inertia) for _ in tree.joints]
    )


def compiled(tree: Tree, phi: np.ndarray) -> kernel.Kernel:
    """Torque, its power, and the rate of kinetic and potential energy."""
    n = len(tree.joints)
    q, v, a = (ca.SX.sym(name, n) for name in "qva")
    parameters, gravity, none = ca.SX(ca.DM(phi.T)), ca.SX(ca.DM(GRAVITY)), ca.SX.zeros(n)
    tau = rnea(tree, q, v, a, parameters, gravity)
    momentum = rnea(tree, q, none, v, parameters, ca.SX.zeros(3))
    kinetic = 0.5 * ca.dot(v, momentum)
    potential = ca.SX(0)
    for pose, body in zip(body_poses(tree, q), phi, strict=True):
        potential -= ca.dot(gravity, body[0] * pose.p + pose.R @ ca.DM(body[1:4]))
    energy = kinetic + potential
    rate = ca.dot(ca.gradient(energy, q), v) + ca.dot(ca.gradient(energy, v), a)
    return kernel.compile(ca.Function("power", [q, v, a], [tau, ca.dot(tau, v), rate, ca.gradient(potential, q)]))


@pytest.fixture(params=["exo", "arm"])
def tree(request: pytest.FixtureRequest, assembly) -> Tree:
    return assembly.exo if request.param == "exo" else assembly.arm.tree


def test_the_power_of_the_torque_is_the_rate_of_energy(tree: Tree):
    function = compiled(tree, bodies(tree, 0))
    for q, v, a in np.random.default_rng(1).uniform(-2.0, 2.0, (50, 3, len(tree.joints))):
        _, power, rate, _ = function.of(q, v, a)
        np.testing.assert_allclose(power, rate, atol=POWER_TOLERANCE)


def test_the_torque_at_rest_is_the_slope_of_the_potential_energy(tree: Tree):
    function, none = compiled(tree, bodies(tree, 2)), np.zeros(len(tree.joints))
    for q in np.random.default_rng(3).uniform(-2.0, 2.0, (20, len(tree.joints))):
        tau, _, _, slope = function.of(q, none, none)
        np.testing.assert_allclose(tau, slope, atol=TORQUE_TOLERANCE)


def test_the_mass_matrix_is_symmetric_and_positive(tree: Tree):
    n = len(tree.joints)
    q, a = ca.SX.sym("q", n), ca.SX.sym("a", n)
    phi = ca.SX(ca.DM(bodies(tree, 4).T))
    inertial = rnea(tree, q, ca.SX.zeros(n), a, phi, ca.SX.zeros(3))
    function = kernel.compile(ca.Function("M", [q], [ca.jacobian(inertial, a)]))
    for posture in np.random.default_rng(5).uniform(-2.0, 2.0, (20, n)):
        (M,) = function.of(posture)
        np.testing.assert_allclose(M, M.T, atol=TORQUE_TOLERANCE)
        assert np.linalg.eigvalsh(M)[0] > 0.0


def test_a_raised_arm_is_held_up_by_a_positive_flexion_torque(assembly):
    tree = assembly.arm.tree
    function, raised, none = compiled(tree, tree.phi), np.zeros(len(tree.joints)), np.zeros(len(tree.joints))
    raised[[tree.index("arm_flexion"), tree.index("arm_elbow")]] = 0.5
    tau = function.of(raised, none, none)[0]
    assert tau[tree.index("arm_flexion")] > 0.0
    assert tau[tree.index("arm_elbow")] > 0.0
