"""Torques of a tree agree with Pinocchio and MuJoCo, and are linear in the inertial parameters as in Pinocchio."""

from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports] - found through a path file
import pytest

from exograv import kernel
from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.regressor import tree_regressor
from exograv.dynamics.rnea import rnea
from exograv.model.tree import Tree, inertial_parameters
from exograv.model.urdf import read_urdf

TOLERANCE = 1e-9  # N·m or N: rounding of torques up to some hundred N·m in three different orders of summation
STATES = 20
SEEDS = range(6)


def compiled(tree: Tree) -> kernel.Kernel:
    n = len(tree.joints)
    q, v, a, phi = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("a", n), ca.SX.sym("phi", 10, n)
    gravity = ca.SX(ca.DM(GRAVITY))
    outputs = [rnea(tree, q, v, a, phi, gravity), tree_regressor(tree, q, v, a, gravity)]
    return kernel.compile(ca.Function("rnea", [q, v, a, phi], outputs))


def states(n: int, seed: int) -> np.ndarray:
    """Positions, velocities, accelerations (state, 3, joint)."""
    return np.random.default_rng(seed).uniform(-2.0, 2.0, (STATES, 3, n)) * np.array([[1.0], [2.0], [4.0]])


def physical_bodies(n: int, seed: int) -> np.ndarray:
    generator = np.random.default_rng(seed)
    inertia = 0.01 * np.diag([1.0, 1.2, 0.7])
    return np.array(
        [inertial_parameters(generator.uniform(0.5, 2.0), generator.normal(0.0, 0.1, 3), inertia) for _ in range(n)]
    )


def worst_difference(tree: Tree, phi: np.ndarray, *oracles) -> float:
    function = compiled(tree)
    worst = 0.0
    for q, v, a in states(len(tree.joints), 1):
        tau, _ = function.of(q, v, a, phi.T)
        worst = max(worst, *(float(np.abs(tau - oracle.torque(q, v, a)).max()) for oracle in oracles))
    return worst


def test_the_machine_costs_the_torque_that_both_engines_say(either_assembly, make_pinocchio, make_mujoco):
    path = either_assembly.description.urdf_path
    tree, text = read_urdf(path), path.read_text(encoding="utf-8")
    oracles = [make(text, tree.joint_names) for make in (make_pinocchio, make_mujoco)]
    assert worst_difference(tree, tree.phi, *oracles) < TOLERANCE


def test_the_machine_set_to_a_wearer_costs_the_torque_that_both_engines_say(
    either_assembly, write_urdf, make_pinocchio, make_mujoco
):
    tree = either_assembly.exo
    text = write_urdf(tree, tree.phi)
    oracles = [make(text, tree.joint_names) for make in (make_pinocchio, make_mujoco)]
    assert worst_difference(tree, tree.phi, *oracles) < TOLERANCE


def test_the_arm_costs_the_torque_that_pinocchio_says(either_assembly, write_urdf, make_pinocchio):
    tree = either_assembly.arm.tree
    oracle = make_pinocchio(write_urdf(tree, tree.phi), tree.joint_names)
    assert worst_difference(tree, tree.phi, oracle) < TOLERANCE


def test_the_arm_with_mass_on_every_joint_costs_the_torque_that_both_engines_say(
    either_assembly, write_urdf, make_pinocchio, make_mujoco
):
    # MuJoCo does not accept a massless body between two joints.
    tree = either_assembly.arm.tree
    phi = physical_bodies(len(tree.joints), 3)
    text = write_urdf(tree, phi)
    oracles = [make(text, tree.joint_names) for make in (make_pinocchio, make_mujoco)]
    assert worst_difference(tree, phi, *oracles) < TOLERANCE


@pytest.mark.parametrize("seed", SEEDS)
def test_a_random_tree_costs_the_torque_that_both_engines_say(
    seed: int, tmp_path: Path, make_random_urdf, make_pinocchio, make_mujoco
):
    text = make_random_urdf(seed)
    path = tmp_path / "random.urdf"
    path.write_text(text, encoding="utf-8")
    tree = read_urdf(path)
    oracles = [make(text, tree.joint_names) for make in (make_pinocchio, make_mujoco)]
    assert worst_difference(tree, tree.phi, *oracles) < TOLERANCE


def test_the_regressor_is_pinocchios_column_by_column(assembly, make_pinocchio):
    path = assembly.description.urdf_path
    tree = read_urdf(path)
    oracle = make_pinocchio(path.read_text(encoding="utf-8"), tree.joint_names)
    function = compiled(tree)
    for q, v, a in states(4, 2):
        _, regressor = function.of(q, v, a, tree.phi.T)
        theirs = pinocchio.computeJointTorqueRegressor(oracle.model, oracle.data, oracle.configuration(q), v, a)
        np.testing.assert_allclose(regressor, theirs, atol=TOLERANCE)


def test_torques_of_two_sets_of_bodies_add(assembly):
    tree = assembly.arm.tree
    function = compiled(tree)
    n = len(tree.joints)
    one, other = physical_bodies(n, 4), physical_bodies(n, 5)
    for q, v, a in states(n, 6):
        together = function.of(q, v, a, (one + other).T)[0]
        apart = function.of(q, v, a, one.T)[0] + function.of(q, v, a, other.T)[0]
        np.testing.assert_allclose(together, apart, atol=TOLERANCE)
