"""The lock torque is the slope of the least energy, computed here by other means."""

import mujoco
import numpy as np
import pytest
from scipy.optimize import minimize

from exograv.model.description import load_rig
from exograv.rig.twin import Disturbances, draw_machine, draw_wearer
from exograv.rig.twin.examiner import held_out_postures
from exograv.rig.twin.world.scene import build_scene
from exograv.rig.twin.world.statics import Statics

SLOPE_STEP = 2e-3  # rad
SLOPE_TOLERANCE = 1e-6  # N·m: five-point differences of energies that are minimised to about 1e-10 J
MIRROR_TOLERANCE = 1e-7  # N·m: twice the tolerance at which a posture counts as rest, times the levers
SHIFT_TABLE_M = {30.0: 0.012, 60.0: 0.025, 90.0: 0.039, 120.0: 0.054}


def shift_from_table(q_arm: np.ndarray, share: float) -> float:
    """Shift of the shoulder at a posture, interpolated as in the twin, but in NumPy and solved from the table here."""
    chord = lambda c: np.sqrt(2.0 * (1.0 - c) + 0.01) - 0.1  # noqa: E731 - the formula in one line
    table = {**SHIFT_TABLE_M, 150.0: 0.070}
    nodes = chord(np.cos(np.deg2rad(list(table))))
    coefficients = np.linalg.solve(np.vander(nodes, 6)[:, :5], list(table.values()))
    return share * np.polyval([*coefficients, 0.0], chord(np.cos(q_arm[0]) * np.cos(q_arm[1])))


def total_energy(scene, wearer, q: np.ndarray, q_arm: np.ndarray) -> float:
    """Energy of cuffs and gravity [J]."""
    model, data = scene.model, scene.data
    data.qpos[scene.exo], data.qpos[scene.arm] = q, q_arm
    data.qpos[scene.followers[0]] = shift_from_table(q_arm, wearer.glenohumeral_share)
    mujoco.mj_kinematics(model, data)
    energy = -float(model.body_mass @ (data.xipos @ model.opt.gravity))
    for place in scene.cuffs:
        R_exo, R_arm = (data.xmat[body].reshape(3, 3) for body in (place.exo_body, place.arm_body))
        e_p = R_exo.T @ (data.xpos[place.arm_body] + R_arm @ place.p_arm - data.xpos[place.exo_body])
        Q = R_exo.T @ R_arm @ place.R_arm
        S = 0.5 * (Q - Q.T)
        e = np.array([*e_p, S[2, 1], S[0, 2], S[1, 0]])
        energy += 0.5 * float(e @ (wearer.cuffs.stiffness * e))
    return energy


def least_energy(scene, wearer, q: np.ndarray, guess: np.ndarray) -> float:
    found = minimize(lambda q_arm: total_energy(scene, wearer, q, q_arm), guess, method="BFGS", options={"gtol": 1e-7})
    return float(found.fun)


@pytest.mark.parametrize("level", [0, 2, 4])
def test_lock_torque_is_the_slope_of_the_least_energy(rig, level: int):
    disturbances = Disturbances.at_level(level)
    wearer, machine = draw_wearer(disturbances, 1), draw_machine(rig, disturbances, 1)
    scene = build_scene(rig, machine, wearer)
    q = np.array([0.9, 0.4, -0.3, 1.1])
    q_arm, tau = Statics(build_scene(rig, machine, wearer), wearer, with_passive=False).settle(q)
    slopes = []
    for step in SLOPE_STEP * np.eye(4):
        near, far = (
            least_energy(scene, wearer, q + k * step, q_arm) - least_energy(scene, wearer, q - k * step, q_arm)
            for k in (1, 2)
        )
        slopes.append((8.0 * near - far) / (12.0 * SLOPE_STEP))
    np.testing.assert_allclose(tau, slopes, atol=SLOPE_TOLERANCE)


@pytest.mark.parametrize(("level", "seed"), [(2, 0), (3, 1), (4, 2)])
def test_the_arm_settles_where_it_would_have_gone_from_the_donning_posture(rig, level: int, seed: int):
    disturbances = Disturbances.at_level(level)
    wearer = draw_wearer(disturbances, seed)
    statics = Statics(build_scene(rig, draw_machine(rig, disturbances, seed), wearer), wearer, with_passive=False)
    for q in held_out_postures(rig)[::10]:
        followed = rig.donning_posture
        for share in np.linspace(0.0, 1.0, 15):
            followed, _ = statics.settle(rig.donning_posture + share * (q - rig.donning_posture), followed)
        np.testing.assert_allclose(statics.settle(q)[0], followed, atol=1e-7)


def test_left_and_right_arms_weigh_the_same_on_mirrored_machines():
    disturbances = Disturbances.at_level(0)
    torques = []
    for side in ("right", "left"):
        description = load_rig("recupera_like", side)
        wearer = draw_wearer(disturbances, 0, side)
        scene = build_scene(description, draw_machine(description, disturbances, 0), wearer)
        torques.append(Statics(scene, wearer, with_passive=False).settle(np.array([0.7, 0.4, -0.3, 1.0]))[1])
    np.testing.assert_allclose(torques[0], torques[1], atol=MIRROR_TOLERANCE)


def test_adjustable_lengths_follow_the_measured_arm_as_far_as_the_machine_goes(rig):
    machine = draw_machine(rig, Disturbances.at_level(0), 0)
    for asked, got in ((0.31, 0.31), (0.10, 0.20), (0.50, 0.37)):
        scene = build_scene(rig, machine, None, {"upper_arm": asked})
        assert scene.model.body("forearm_exo").pos[2] == pytest.approx(-got)
