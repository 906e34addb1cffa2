"""The torque that carries machine and arm is the gradient of their potential energy, and linear in their masses."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from exograv.dynamics.carrying import carried
from exograv.dynamics.loop_torque import GRAVITY
from exograv.model.anthropometry import Body
from exograv.model.arm import held_weight
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.kinematics import body_poses
from exograv.model.loops import LoopSolver, arm_poses, fit_names
from exograv.model.support import assemble, sample_postures
from exograv.model.tree import Tree

STEP = 1e-5  # rad
SLOPE_TOLERANCE = 1e-6
"""Tolerance of central differences at that step [N·m]; the closed posture is exact to 1e-9 rad."""


@pytest.fixture(scope="module", params=["recupera_like", "nesm_like", "recupera_like_7", "recupera_like_dual"])
def assembly(request: pytest.FixtureRequest) -> Assembly:
    return assemble(load_rig(request.param), Body(1.75, 75.0, "male"))


def height_energy(tree: Tree, phi: np.ndarray, poses) -> ca.SX:
    """Potential energy −g · Σ (m·p + R·h) [J]."""
    moment = sum(
        (row[0] * pose.p + pose.R @ ca.DM(row[1:4]) for row, pose in zip(phi, poses, strict=True)), ca.SX.zeros(3)
    )
    return -ca.dot(ca.DM(GRAVITY), moment)


def energies(assembly: Assembly, y: np.ndarray, z: np.ndarray) -> np.ndarray:
    """Potential energies of the machine, the arm and 1 kg in each hand, at one posture [J]."""
    arm, fit = assembly.arm, ca.SX.zeros(len(fit_names(assembly)))
    exo = height_energy(assembly.exo, assembly.exo.phi, body_poses(assembly.exo, ca.SX(ca.DM(y))))
    poses = arm_poses(assembly, ca.SX(ca.DM(z)), fit)
    weights = sum((held_weight(arm, 1.0, limb) for limb in range(len(arm.limbs))), np.zeros_like(arm.phi))
    found = [exo]
    for phi in (arm.phi, weights):
        masses = np.zeros((len(arm.tree.joints), 10))
        masses[list(arm.bodies)] = phi.reshape(-1, 10)
        found.append(height_energy(arm.tree, masses, poses))
    return np.array([float(ca.evalf(energy)) for energy in found])


def test_what_is_carried_is_the_slope_of_the_height_energy_along_the_closed_loops(assembly: Assembly):
    solver = LoopSolver(assembly)
    postures = sample_postures(assembly.description, 2)
    found = carried(assembly, postures)
    for k, y in enumerate(postures):
        for i, way in enumerate(np.eye(assembly.n)):
            ends = [y + sign * STEP * way for sign in (1.0, -1.0)]
            up, down = (energies(assembly, end, solver.solve(end)[0]) for end in ends)
            slope = (up - down) / (2 * STEP)
            torque = [found.exo[k, i], found.arm[k, i], found.hand[k, i]]
            np.testing.assert_allclose(torque, slope, atol=SLOPE_TOLERANCE)


def test_a_double_arm_asks_for_twice_the_torque_and_the_rest_stays(assembly: Assembly):
    postures = sample_postures(assembly.description, 2)
    heavy = replace(assembly, arm=replace(assembly.arm, phi=2.0 * assembly.arm.phi))
    single, double = carried(assembly, postures), carried(heavy, postures)
    np.testing.assert_allclose(double.arm, 2.0 * single.arm, rtol=1e-12)
    np.testing.assert_array_equal(double.exo, single.exo)
    np.testing.assert_array_equal(double.hand, single.hand)
