"""Under water an arm loses the weight of the displaced water and feels the drag of its boxes; machines stay dry."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from exograv.model.description import RigDescription
from exograv.rig.twin import Disturbances, draw_machine, draw_wearer
from exograv.rig.twin.world.scene import Scene, build_scene
from exograv.rig.twin.world.surroundings import Surroundings
from exograv.rig.twin.world.water import BODY_DENSITY, Water

NONE = Disturbances.at_level(0)
AIR = Surroundings(np.array([5.0, 0.0, 0.0]), 0.0, -5.0)
RELATIVE = 1e-6
DRY_NM = 1e-8  # viscous drag of spheres of a micrometre, a metre from the joint


def scene_of(rig: RigDescription, water: Water | None) -> Scene:
    return build_scene(
        rig, draw_machine(rig, NONE, 0), draw_wearer(NONE, 0), surroundings=replace(AIR, water=water)
    )  # fmt: skip


def passive(scene: Scene, qvel: np.ndarray) -> np.ndarray:
    """Forces of the water on all freedoms by MuJoCo, the machine's first [N·m]."""
    scene.data.qvel[:] = qvel
    mujoco.mj_step1(scene.model, scene.data)
    return scene.data.qfrc_passive.copy()


def test_each_bone_loses_the_weight_of_the_water_in_its_place(rig: RigDescription):
    scene, water = scene_of(rig, Water()), Water()
    still = np.zeros(scene.model.nv)
    lifted, expected = passive(scene, still)[scene.arm], np.zeros(scene.model.nv)
    for bone, body in zip(scene.arms[0].skeleton.bones, scene.arms[0].bodies, strict=True):
        J = np.zeros((3, scene.model.nv))
        mujoco.mj_jacBodyCom(scene.model, scene.data, J, None, body)
        displaced = scene.model.body_mass[body] * water.density / BODY_DENSITY[bone.segment]
        expected += J.T @ (-displaced * scene.model.opt.gravity)
    np.testing.assert_allclose(lifted, expected[scene.arm], rtol=RELATIVE, atol=1e-9)
    assert np.abs(lifted).max() > 1.0


def test_the_arm_feels_the_drag_that_its_boxes_predict(rig: RigDescription):
    scene, water = scene_of(rig, Water()), Water()
    model, data, velocity = scene.model, scene.data, np.zeros(scene.model.nv)
    at_rest = passive(scene, velocity)
    velocity[scene.arm[0]] = 1.5
    drag, power = (passive(scene, velocity) - at_rest)[scene.arm], 0.0
    for body in scene.arms[0].bodies:
        if model.body_mass[body] < 1e-6:
            continue
        inertia = model.body_inertia[body]
        sides = np.sqrt(6.0 / model.body_mass[body] * (inertia.sum() - 2.0 * inertia))
        J, J_turn = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        mujoco.mj_jacBodyCom(model, data, J, J_turn, body)
        R_world_box = data.ximat[body].reshape(3, 3)
        linear, omega = R_world_box.T @ (J @ velocity), R_world_box.T @ (J_turn @ velocity)
        areas = np.array([sides[1] * sides[2], sides[0] * sides[2], sides[0] * sides[1]])
        power += 0.5 * water.density * float(areas @ np.abs(linear) ** 3)
        turning = [
            sides[k] * (sides[i] ** 4 + sides[j] ** 4) * abs(omega[k]) ** 3
            for k, i, j in ((0, 1, 2), (1, 0, 2), (2, 0, 1))
        ]
        power += water.density / 64.0 * sum(turning)
        diameter = sides.mean()
        viscous = 3.0 * np.pi * diameter * (linear @ linear) + np.pi * diameter**3 * (omega @ omega)
        power += water.viscosity * float(viscous)
    assert -drag @ velocity[scene.arm] == pytest.approx(power, rel=0.02)
    assert power > 0.5


def test_a_machine_stays_dry(rig: RigDescription):
    scene = scene_of(rig, Water())
    velocity = np.zeros(scene.model.nv)
    velocity[scene.exo] = 2.0
    np.testing.assert_allclose(passive(scene, velocity)[scene.exo], 0.0, atol=DRY_NM)


def test_in_air_nothing_is_lifted_and_nothing_drags(rig: RigDescription):
    scene = scene_of(rig, None)
    assert not passive(scene, np.ones(scene.model.nv)).any()
