"""Cuffs are springs: their wrenches derive from their energy and act both ways, and their dampers only dissipate."""

import casadi as ca
import mujoco
import numpy as np
import pytest

from exograv.rig.twin import Disturbances, draw_wearer
from exograv.rig.twin.world.cuffs import Kinematics, cuff_wrenches
from exograv.rig.twin.world.forces import static_forces

LEVEL = Disturbances.at_level(2)
DIFFERENCE = 1e-6  # rad, m
DERIVATIVE_TOLERANCE = 1e-6  # N·m: central differences of an energy of about 1 J


def vee(matrix: np.ndarray) -> np.ndarray:
    return np.array([matrix[2, 1], matrix[0, 2], matrix[1, 0]])


def cuff_energy(scene, cuffs, qpos: np.ndarray) -> float:
    """Energy of the cuffs [J], computed independently in NumPy."""
    data = mujoco.MjData(scene.model)
    data.qpos[:] = qpos
    mujoco.mj_kinematics(scene.model, data)
    energy = 0.0
    for place in scene.cuffs:
        R_exo, R_arm = (data.xmat[body].reshape(3, 3) for body in (place.exo_body, place.arm_body))
        e_p = R_exo.T @ (data.xpos[place.arm_body] + R_arm @ place.p_arm - data.xpos[place.exo_body])
        Q = R_exo.T @ R_arm @ place.R_arm
        e = np.concatenate([e_p, 0.5 * vee(Q - Q.T)])
        energy += 0.5 * e @ (cuffs.stiffness * e)
    return energy


def test_no_cuff_is_strained_at_the_donning_posture(rig, make_scene):
    scene, wearer = make_scene(LEVEL), draw_wearer(LEVEL, 0)
    qpos = np.zeros(scene.model.nq)
    qpos[scene.exo], qpos[scene.arm] = scene.fastened
    np.testing.assert_array_equal(scene.fastened[0], rig.donning_posture)
    assert cuff_energy(scene, wearer.cuffs, qpos) == pytest.approx(0.0, abs=1e-20)


@pytest.mark.parametrize("seed", range(4))
def test_cuff_torques_are_the_slope_of_the_cuff_energy(make_scene, seed: int):
    scene, wearer = make_scene(LEVEL, seed), draw_wearer(LEVEL, seed)
    forces = static_forces(scene, wearer, with_passive=False)
    scene.model.opt.gravity[:] = 0.0
    generator = np.random.default_rng(seed)
    # Far beyond what a cuff allows, so that a transposed moment would show.
    qpos = np.concatenate([[0.6, 0.3, 0.2, 1.2], [0.03], np.array([0.6, 0.3, 0.2, 1.2]) + generator.normal(0, 0.3, 4)])
    scene.data.qpos[:] = qpos
    mujoco.mj_step1(scene.model, scene.data)
    forces.evaluate()
    mujoco.mj_fwdAcceleration(scene.model, scene.data)
    steps = DIFFERENCE * np.eye(len(qpos))
    slope = [cuff_energy(scene, wearer.cuffs, qpos + s) - cuff_energy(scene, wearer.cuffs, qpos - s) for s in steps]
    slope = np.array(slope) / (2.0 * DIFFERENCE)
    np.testing.assert_allclose(scene.data.qfrc_smooth, -slope, atol=DERIVATIVE_TOLERANCE * max(1.0, abs(slope).max()))


def wrenches_of(scene, wearer):
    kinematics = Kinematics.of(scene.model.nbody)
    symbols = list(vars(kinematics).values())
    function = ca.Function("wrenches", symbols, [cuff_wrenches(scene, wearer.cuffs, kinematics)])
    arrays = [np.asarray(getattr(scene.data, name)).T for name in vars(kinematics)]
    return np.asarray(function(*arrays))


@pytest.mark.parametrize("seed", range(4))
def test_action_equals_reaction_about_any_point(make_scene, seed: int):
    scene, wearer = make_scene(LEVEL, seed), draw_wearer(LEVEL, seed)
    generator = np.random.default_rng(seed)
    scene.data.qpos[:] = generator.uniform(-0.2, 0.8, scene.model.nq)
    scene.data.qvel[:] = generator.uniform(-1.0, 1.0, scene.model.nv)
    mujoco.mj_forward(scene.model, scene.data)
    wrenches = wrenches_of(scene, wearer)
    force, moment = wrenches[:3], wrenches[3:] + np.cross(scene.data.xipos.T, wrenches[:3], axis=0)
    np.testing.assert_allclose(force.sum(axis=1), 0.0, atol=1e-9 * np.abs(force).max())
    np.testing.assert_allclose(moment.sum(axis=1), 0.0, atol=1e-9 * np.abs(moment).max())


@pytest.mark.parametrize("seed", range(8))
def test_cuff_dampers_take_power_whatever_moves(make_scene, seed: int):
    scene, wearer = make_scene(LEVEL, seed), draw_wearer(LEVEL, seed)
    generator = np.random.default_rng(seed)
    scene.data.qpos[:] = generator.uniform(-0.2, 0.8, scene.model.nq)
    mujoco.mj_forward(scene.model, scene.data)
    at_rest = wrenches_of(scene, wearer)
    scene.data.qvel[:] = generator.uniform(-1.0, 1.0, scene.model.nv)
    mujoco.mj_forward(scene.model, scene.data)
    damping = wrenches_of(scene, wearer) - at_rest
    power = 0.0
    for body in range(scene.model.nbody):
        J_p, J_r = np.zeros((3, scene.model.nv)), np.zeros((3, scene.model.nv))
        mujoco.mj_jacBodyCom(scene.model, scene.data, J_p, J_r, body)
        power += damping[:3, body] @ J_p @ scene.data.qvel + damping[3:, body] @ J_r @ scene.data.qvel
    assert power < 0.0
