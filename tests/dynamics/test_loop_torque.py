"""Exoskeleton, cuffs and arm conserve energy, and mirrored arms need mirrored torques."""

from collections.abc import Callable

import casadi as ca
import numpy as np
import pytest

from exograv import kernel
from exograv.dynamics.closure import closure, cuff_energy, newton_step
from exograv.dynamics.loop_torque import GRAVITY, ArmExpression, LoopTorque, arm_load, exo_torque, static_load
from exograv.model.anthropometry import Body
from exograv.model.arm import held_weight
from exograv.model.assembly import Assembly
from exograv.model.description import load_rig
from exograv.model.loops import FIT, LoopSolver
from exograv.model.support import assemble
from exograv.options import Side

POWER_TOLERANCE = 2e-6  # W: fourth-order differences at 1 ms of energies of 30 J
PARITY = 1e-9  # N·m: the same sums with other signs; two searches agree within 1e-10 rad
SAME_SUMS = 1e-12  # relative, and N·m: the same products in another order
DT = 1e-3
ROTOR = 0.25
PASSIVE = (1.5, 0.8, 0.4)
"""Stiffness, spring offset and damping of every freedom."""


def torque_kernel(assembly: Assembly, passive: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> kernel.Kernel:
    """Torques by origin, and the energy of the cuffs."""
    cuffs = cuff_energy(assembly)
    y, z, fit = ca.SX.sym("y", 4), ca.SX.sym("z", 4), ca.SX.sym("fit", len(FIT))
    v, a, phi, gravity = ca.SX.sym("v", 4), ca.SX.sym("a", 4), ca.SX.sym("phi", 20), ca.SX.sym("gravity", 3)
    closed = closure(cuffs, y, newton_step(cuffs, y, z, fit), fit)
    arm = ArmExpression(phi, fit, *(value * ca.SX.ones(4) for value in passive))
    torque = LoopTorque(
        exo_torque(assembly, assembly.exo.phi, ROTOR * ca.SX.ones(4), (y, v, a), gravity),
        closed.G.T @ arm_load(assembly, arm, cuffs, closed, (y, v, a), gravity),
        closed.strain,
    )
    energy = ca.Function("energy", [cuffs.y, cuffs.z, cuffs.fit], [cuffs.energy])(y, closed.z, fit)
    outputs = [closed.z, torque.exo, torque.arm, torque.strain, torque.total, energy]
    return kernel.compile(ca.Function("torque", [y, z, fit, v, a, phi, gravity], outputs))


def settled(compiled: kernel.Kernel, y: np.ndarray, z: np.ndarray, *rest: np.ndarray) -> list[np.ndarray]:
    """Outputs after Newton's method has converged."""
    for _ in range(3):
        z = compiled.of(y, z, *rest)[0]
    return list(compiled.of(y, z, *rest))


@pytest.fixture(scope="module")
def torque(assembly, fit) -> Callable[..., list[np.ndarray]]:
    compiled, solver = torque_kernel(assembly), LoopSolver(assembly)

    def at(y, v, a, phi=assembly.arm.phi, gravity=GRAVITY, fit=fit) -> list[np.ndarray]:
        z = solver.solve(y, fit=fit)[0]
        return settled(compiled, y, z, fit, v, a, phi, gravity)

    return at


def motion(t: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Posture, velocity and acceleration of a brisk movement."""
    centre, reach = np.array([0.8, 0.4, 0.0, 1.2]), np.array([0.5, 0.3, 0.4, 0.5])
    rate, phase = np.array([2.0, 2.5, 3.0, 3.5]), np.array([0.0, 1.0, 2.0, 3.0])
    s, c = np.sin(rate * t + phase), np.cos(rate * t + phase)
    return centre + reach * s, reach * rate * c, -reach * rate**2 * s


def test_the_power_of_all_torques_is_the_rate_of_all_energies(torque):
    none = np.zeros(4)

    def kinetic_and_cuffs(t: float) -> float:
        y, v, _ = motion(t)
        # At rest, without gravity, an acceleration of v needs the torque M v.
        _, exo, arm, _, _, cuffs = torque(y, none, v, gravity=np.zeros(3))
        return 0.5 * float(v @ (exo + arm)) + cuffs.item()

    for t in (0.1, 0.7, 1.3):
        y, v, a = motion(t)
        near = kinetic_and_cuffs(t + DT) - kinetic_and_cuffs(t - DT)
        far = kinetic_and_cuffs(t + 2 * DT) - kinetic_and_cuffs(t - 2 * DT)
        rate = (8 * near - far) / (12 * DT)
        assert v @ torque(y, v, a, gravity=np.zeros(3))[4] == pytest.approx(rate, abs=POWER_TOLERANCE)


def test_gravity_does_no_work_around_a_closed_path(torque):
    none = np.zeros(4)
    t = np.linspace(0.0, 2 * np.pi, 200, endpoint=False)
    centre, reach = np.array([0.8, 0.4, 0.0, 1.2]), np.array([0.5, 0.3, 0.4, 0.5])
    phase = np.array([0.0, 1.0, 2.0, 3.0])
    work = 0.0
    for moment in t:
        y, way = centre + reach * np.sin(moment + phase), reach * np.cos(moment + phase)
        outputs = torque(y, none, none)
        # The posture is closed without load: exo and arm need the gradient of their potentials at this posture.
        work += float(way @ outputs[4]) * (t[1] - t[0])
    assert work == pytest.approx(0.0, abs=1e-8)  # the trapezoid rule is exact for a smooth periodic path


def test_torque_is_linear_in_the_arms_parameters(assembly, torque):
    generator = np.random.default_rng(0)
    y, v, a = motion(0.4)
    one, other = generator.normal(size=(2, 20))
    arm = [torque(y, v, a, phi=phi)[2] for phi in (one, other, 2.0 * one - 3.0 * other)]
    np.testing.assert_allclose(arm[2], 2.0 * arm[0] - 3.0 * arm[1], atol=PARITY)


def test_an_arm_without_mass_leaves_the_strain(torque):
    y, v, a = motion(0.4)
    _, exo, arm, strain, total, _ = torque(y, v, a, phi=np.zeros(20))
    np.testing.assert_array_equal(arm, 0.0)
    assert np.abs(strain).max() > 0.01
    np.testing.assert_allclose(total, exo + strain)


def test_the_strain_knows_neither_gravity_nor_mass(torque):
    y, v, a = motion(0.4)
    strain = torque(y, v, a)[3]
    np.testing.assert_array_equal(torque(y, v, a, phi=np.zeros(20))[3], strain)
    np.testing.assert_array_equal(torque(y, v, a, gravity=np.zeros(3))[3], strain)


def test_a_weight_in_the_hand_of_an_aligned_arm_adds_its_weight_times_its_lever(assembly, torque):
    y, none = np.array([0.0, 0.0, 0.0, np.pi / 2]), np.zeros(4)
    aligned = np.zeros(len(FIT))
    weight = held_weight(assembly.arm, 1.0)
    added = torque(y, none, none, phi=weight, fit=aligned)[2]
    lever = assembly.arm.lengths["forearm"] + 0.36 * assembly.arm.lengths["hand"]
    np.testing.assert_allclose(added, [9.81 * lever, 0.0, 0.0, 9.81 * lever], atol=PARITY)


def test_passive_joints_cost_what_the_arms_own_joints_would(assembly, fit):
    stiffness, offset, damping = PASSIVE
    with_springs, without = torque_kernel(assembly, PASSIVE), torque_kernel(assembly)
    y, v, a = motion(0.4)
    aligned = np.zeros(len(FIT))
    arguments = (y, y, aligned, v, a, assembly.arm.phi, GRAVITY)
    difference = with_springs.of(*arguments)[2] - without.of(*arguments)[2]
    np.testing.assert_allclose(difference, stiffness * y - offset + damping * v, atol=PARITY)


def torque_and_derivatives(assembly: Assembly) -> ca.Function:
    """Closed posture, torque of a motion, and the torque's derivatives by posture and fit."""
    cuffs = cuff_energy(assembly)
    y, z, fit = ca.SX.sym("y", 4), ca.SX.sym("z", 4), ca.SX.sym("fit", len(FIT))
    v, a, passive = ca.SX.sym("v", 4), ca.SX.sym("a", 4), (value * ca.SX.ones(4) for value in PASSIVE)
    arm = ArmExpression(ca.SX(ca.DM(assembly.arm.phi)), fit, *passive)
    stepped = newton_step(cuffs, y, z, fit, static_load(assembly, arm, z, GRAVITY))
    closed = closure(cuffs, y, stepped, fit, static_load(assembly, arm, stepped, GRAVITY))
    torque = closed.G.T @ arm_load(assembly, arm, cuffs, closed, (y, v, a), GRAVITY) + closed.strain
    return ca.Function("derived", [y, z, fit, v, a], [closed.z, torque, ca.jacobian(torque, ca.vertcat(y, fit))])


def test_left_and_right_cost_the_same(fit):
    mirrored_fit = fit * np.where(np.isin(FIT, ["shoulder_offset_y", "elbow_axis_x", "elbow_axis_z"]), -1.0, 1.0)
    totals = []
    sides: list[tuple[Side, np.ndarray]] = [("right", fit), ("left", mirrored_fit)]
    for side, own_fit in sides:
        assembly = assemble(load_rig("recupera_like", side), Body(1.75, 75.0, "male"))
        compiled, (y, v, a) = torque_kernel(assembly, PASSIVE), motion(0.6)
        z = LoopSolver(assembly).solve(y, fit=own_fit)[0]
        totals.append(settled(compiled, y, z, own_fit, v, a, assembly.arm.phi, GRAVITY)[4])
    np.testing.assert_allclose(*totals, atol=PARITY)
