"""The internal model of a wearer's arm has its true weight and inertia; a machine's links are reported as built."""

from dataclasses import replace

import mujoco
import numpy as np

from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.rig.twin import Disturbances, draw_machine, draw_wearer
from exograv.rig.twin.behaviour.internal_model import ArmInverseDynamics, in_gravity, worn_inertia
from exograv.rig.twin.wearer.passive import follower_paths
from exograv.rig.twin.world.link_truth import link_truth
from exograv.rig.twin.world.scene import build_scene

LEVEL_2 = Disturbances.at_level(2)
POSTURE = np.deg2rad([40.0, 15.0, 20.0, 60.0])
STILL = np.zeros(4)
STEP = 1e-5


def weight_energy(rig: RigDescription, machine, wearer, q: np.ndarray) -> float:
    """Energy of the arm alone in gravity [J]. The machine does not move, so its energy is constant."""
    import casadi as ca

    scene = build_scene(rig, machine, wearer)
    symbol = ca.SX.sym("q", len(q))
    led = ca.Function("led", [symbol], [follower_paths(wearer, symbol)])
    scene.data.qpos[scene.arm], scene.data.qpos[scene.followers] = q, np.asarray(led(q)).ravel()
    scene.model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    mujoco.mj_forward(scene.model, scene.data)
    return float(scene.data.energy[0])


def test_holding_the_arm_takes_the_slope_of_its_energy(rig: RigDescription):
    machine, wearer = draw_machine(rig, LEVEL_2, 1), draw_wearer(LEVEL_2, 1)
    own = ArmInverseDynamics(rig, machine, wearer)
    for_weight = own.torque(POSTURE, STILL, STILL, 1.0) - own.torque(POSTURE, STILL, STILL, 0.0)
    steps = STEP * np.eye(4)
    slope = [
        (weight_energy(rig, machine, wearer, POSTURE + s) - weight_energy(rig, machine, wearer, POSTURE - s))
        / (2 * STEP)
        for s in steps
    ]
    np.testing.assert_allclose(for_weight, slope, atol=1e-5)


def test_the_own_inertia_is_that_of_a_body(rig: RigDescription):
    inertia = ArmInverseDynamics(rig, draw_machine(rig, LEVEL_2, 1), draw_wearer(LEVEL_2, 1)).inertia(POSTURE)
    np.testing.assert_allclose(inertia, inertia.T, atol=1e-9)
    assert (np.linalg.eigvalsh(inertia) > 0.0).all()


def test_in_stiff_cuffs_the_worn_inertia_is_that_of_links_and_rotors(rig: RigDescription):
    level_0 = Disturbances.at_level(0)
    machine, wearer = draw_machine(rig, level_0, 1), draw_wearer(level_0, 1)
    heavier = replace(machine, drives=replace(machine.drives, rotor_inertia=machine.drives.rotor_inertia + 0.5))
    worn, with_more = (worn_inertia(rig, one, wearer) for one in (machine, heavier))
    assert (np.linalg.eigvalsh(worn) > 0.0).all()
    np.testing.assert_allclose(with_more - worn, 0.5 * np.eye(4), atol=0.05)


def test_a_weightless_machine_has_lost_nothing_but_its_weight(rig: RigDescription):
    machine = draw_machine(rig, LEVEL_2, 1)
    np.testing.assert_array_equal(in_gravity(machine, 0.0).gravity, 0.0)
    assert in_gravity(machine, 1.8).friction is machine.friction


def test_without_errors_the_links_are_as_drawn(rig: RigDescription):
    machine, lengths = draw_machine(rig, Disturbances.at_level(0), 1), {"upper_arm": 0.3, "forearm": 0.26, "hand": 0.19}
    tree = adjusted(read_exoskeleton(rig), rig, lengths)
    np.testing.assert_allclose(link_truth(rig, machine, lengths), tree.phi, atol=1e-9)


def test_a_link_that_is_heavier_than_drawn_is_told_so(rig: RigDescription):
    machine, lengths = draw_machine(rig, LEVEL_2, 1), {"upper_arm": 0.29, "forearm": 0.26, "hand": 0.19}
    tree = read_exoskeleton(rig)
    factors = link_truth(rig, machine, lengths)[:, 0] / tree.phi[:, 0]
    links = ("shoulder_yoke", "shoulder_guide", "upper_arm_exo", "forearm_exo")
    np.testing.assert_allclose(factors, [machine.link_error(link)[0] for link in links], rtol=1e-9)
