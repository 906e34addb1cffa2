"""The torque at rest is the gradient of all energies on every machine; two arms are independent of each other."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest
from tests.shoulder_path import FURTHER_PATH

from exograv import kernel
from exograv.dynamics.closure import closure, cuff_energy, newton_step
from exograv.dynamics.loop_torque import GRAVITY, ArmExpression, arm_load, exo_torque, static_load
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig, rig_names
from exograv.model.kinematics import body_poses
from exograv.model.loops import LoopSolver, arm_poses, fit_names
from exograv.model.support import assemble
from exograv.model.tree import Tree
from exograv.spatial import Transform

STEP = 1e-3  # rad, of fourth-order differences
TOLERANCE = 1e-8  # N·m: of energies of 30 J
PARITY = 1e-10  # N·m: the same sums in another order
OFFSETS = np.array([0.012, -0.009, 0.007, 0.02, 0.006, 0.2, -0.3, 0.12, 0.08, 0.008, -0.006, *FURTHER_PATH])
FOUR_JOINTS = "recupera_like"


def weight_energy(tree: Tree, poses: list[Transform]) -> ca.SX:
    """Potential energy of all bodies [J], by the heights of their centres."""
    heights = [
        phi[0] * pose.p[2] + ca.dot(ca.DM(phi[1:4]), pose.R[2, :].T) for phi, pose in zip(tree.phi, poses, strict=True)
    ]
    return -GRAVITY[2] * sum(heights)


class AtRest:
    """Torque and energy in the equilibrium of cuffs and weight."""

    def __init__(self, assembly: Assembly):
        self.n = assembly.n
        y, z = ca.SX.sym("y", assembly.n), ca.SX.sym("z", assembly.n_freedoms)
        fit, still = ca.SX.sym("fit", len(fit_names(assembly))), ca.SX.zeros(assembly.n)
        none, cuffs = ca.SX.zeros(assembly.n_freedoms), cuff_energy(assembly)
        arm = ArmExpression(ca.SX(ca.DM(assembly.arm.phi)), fit, none, none, none)
        z_next = newton_step(cuffs, y, z, fit, static_load(assembly, arm, z, GRAVITY))
        closed = closure(cuffs, y, z_next, fit, static_load(assembly, arm, z_next, GRAVITY))
        exo = exo_torque(assembly, assembly.exo.phi, still, (y, still, still), GRAVITY)
        load = arm_load(assembly, arm, cuffs, closed, (y, still, still), GRAVITY)
        poses = arm_poses(assembly, closed.z, fit)
        energy = weight_energy(assembly.arm.tree, poses) + weight_energy(assembly.exo, body_poses(assembly.exo, y))
        energy += ca.Function("cuffs", [cuffs.y, cuffs.z, cuffs.fit], [cuffs.energy])(y, closed.z, fit)
        outputs = [closed.z, exo + closed.G.T @ load + closed.strain, energy]
        self._kernel = kernel.compile(ca.Function("at_rest", [y, z, fit], outputs))
        self._solver = LoopSolver(assembly)
        self.fit = np.tile(OFFSETS, len(assembly.arm.limbs))

    def __call__(self, y: np.ndarray) -> tuple[np.ndarray, float]:
        z = self._solver.solve(y, fit=self.fit)[0]
        for _ in range(4):
            z = self._kernel.of(y, z, self.fit)[0]
        _, torque, energy = self._kernel.of(y, z, self.fit)
        return torque, energy.item()


def worn(rig: str) -> Assembly:
    return assemble(load_rig(rig), Body(1.75, 75.0, "male"))


@pytest.fixture(scope="module")
def at_rest() -> Callable[[str], AtRest]:
    known: dict[str, AtRest] = {}

    def of(rig: str) -> AtRest:
        if rig not in known:
            known[rig] = AtRest(worn(rig))
        return known[rig]

    return of


@pytest.mark.parametrize("rig", rig_names())
def test_the_torque_at_rest_is_the_slope_of_the_energy_of_weight_and_cuffs(rig: str, at_rest):
    machine = at_rest(rig)
    lower, upper = load_rig(rig).workspace
    y = np.random.default_rng(0).uniform(lower, upper)
    slope = np.array(
        [
            (8 * (machine(y + way)[1] - machine(y - way)[1]) - (machine(y + 2 * way)[1] - machine(y - 2 * way)[1]))
            / (12 * STEP)
            for way in STEP * np.eye(machine.n)
        ]
    )
    np.testing.assert_allclose(machine(y)[0], slope, atol=TOLERANCE)


def test_each_arm_of_two_costs_what_it_costs_alone(at_rest):
    both = at_rest("recupera_like_dual")
    generator = np.random.default_rng(1)
    alone = at_rest(FOUR_JOINTS)
    lower, upper = load_rig(FOUR_JOINTS).workspace
    right, left = generator.uniform(lower, upper, (2, 4))
    torque = both(np.concatenate([right, left]))[0]
    elsewhere = both(np.concatenate([right, generator.uniform(lower, upper)]))[0]
    np.testing.assert_allclose(torque[:4], alone(right)[0], atol=PARITY)
    np.testing.assert_allclose(elsewhere[:4], torque[:4], atol=PARITY)
    assert np.abs(elsewhere[4:] - torque[4:]).max() > 0.1


def test_an_arm_of_seven_freedoms_with_a_straight_hand_weighs_what_one_of_four_does():
    seven, four = worn("recupera_like_7"), worn(FOUR_JOINTS)
    assert seven.arm.phi[[0, 10, 20]].sum() == pytest.approx(four.arm.phi[[0, 10]].sum())
    assert seven.arm.freedoms[:4] == four.arm.freedoms
