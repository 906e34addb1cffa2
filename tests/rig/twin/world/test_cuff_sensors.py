"""Sensors at the cuffs measure what carries the arm, with the errors of their level. Unused sensors change nothing."""

import mujoco
import numpy as np
import pytest

from exograv.rig.interface import CuffSensing
from exograv.rig.twin import Disturbances, draw_machine, draw_wearer
from exograv.rig.twin.world.cuff_sensors import CuffSensors
from exograv.rig.twin.world.scene import build_scene
from exograv.rig.twin.world.statics import Statics
from exograv.signals import Command

LEVELS = [Disturbances.at_level(level) for level in range(5)]
PERFECT = [level.without("cuff_sensors") for level in LEVELS]
REST_NM = 1e-8  # ten times what the statics leave on a joint
POSTURE = np.array([0.9, 0.4, -0.3, 1.1])


@pytest.fixture
def at_rest(rig):
    """Scene in which the arm lies at rest in its cuffs, and the wrenches of perfect sensors there, in world axes."""

    def make(level: int, seed: int = 1):
        disturbances = PERFECT[level]
        machine, wearer = draw_machine(rig, disturbances, seed), draw_wearer(disturbances, seed)
        scene = build_scene(rig, machine, wearer)
        Statics(scene, wearer, with_passive=False).settle(POSTURE)
        measured = CuffSensors(machine.cuff_sensors, 0, scene, wearer).measure()
        turned = []
        for place, wrench in zip(scene.cuffs, measured, strict=True):
            R = scene.data.xmat[place.exo_body].reshape(3, 3)
            turned.append((place, R @ wrench[:3], R @ wrench[3:]))
        return scene, turned

    return make


@pytest.mark.parametrize("level", [0, 2, 4])
def test_cuffs_and_shoulder_together_carry_the_arms_weight(at_rest, level: int):
    scene, wrenches = at_rest(level)
    mujoco.mj_rnePostConstraint(scene.model, scene.data)
    first = int(scene.model.dof_bodyid[scene.arm[0]])
    shoulder = scene.data.cfrc_int[scene.model.body_rootid[first]][3:]
    weight = scene.model.opt.gravity * sum(scene.model.body_mass[body] for body in scene.arms[0].bodies)
    carried = shoulder + sum(force for _, force, _ in wrenches)
    np.testing.assert_allclose(carried, -weight, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
def test_at_rest_the_cuffs_give_the_torque_that_the_weight_asks_of_the_arms_joints(at_rest, seed: int):
    scene, wrenches = at_rest(0, seed)  # a fixed shoulder centre: a force on its path acts on no joint
    torque = np.zeros(scene.model.nv)
    for place, force, moment in wrenches:
        J_p, J_r = np.zeros((3, scene.model.nv)), np.zeros((3, scene.model.nv))
        mujoco.mj_jac(scene.model, scene.data, J_p, J_r, scene.data.xpos[place.exo_body], place.arm_body)
        torque += J_p.T @ force + J_r.T @ moment
    np.testing.assert_allclose(torque[scene.arm], scene.data.qfrc_bias[scene.arm], atol=REST_NM)


def test_the_twin_has_such_sensors_and_repeats_itself_within_a_period(make_twin):
    twin = make_twin(LEVELS[2])
    assert isinstance(twin, CuffSensing)
    first = twin.cuff_wrenches()
    np.testing.assert_array_equal(first, twin.cuff_wrenches())
    step(twin)
    assert not np.array_equal(first, twin.cuff_wrenches())


def test_reading_the_cuffs_changes_nothing_else(make_twin):
    asked, left_alone = make_twin(LEVELS[3]), make_twin(LEVELS[3])
    for _ in range(50):
        asked.cuff_wrenches()
        step(asked)
        step(left_alone)
    np.testing.assert_array_equal(asked.read().q, left_alone.read().q)
    np.testing.assert_array_equal(asked.read().current, left_alone.read().current)


def test_an_empty_machine_feels_only_what_taring_left(make_twin):
    twin = make_twin(LEVELS[2], is_worn=False)
    measured = []
    for _ in range(400):
        measured.append(twin.cuff_wrenches())
        step(twin)
    errors = twin.truth.machine.cuff_sensors
    # Four standard deviations of a mean of 400.
    assert (np.abs(np.mean(measured, axis=0) - errors.bias) < 0.2 * errors.noise).all()


def test_errors_have_the_spread_of_their_level(rig):
    drawn = [draw_machine(rig, LEVELS[2], seed).cuff_sensors for seed in range(300)]
    bias = np.array([one.bias for one in drawn])
    assert np.std(bias[..., :3]) == pytest.approx(0.33, rel=0.1)
    assert np.std(bias[..., 3:]) == pytest.approx(0.012, rel=0.1)
    assert np.std([one.gain for one in drawn]) == pytest.approx(0.01, rel=0.1)


def step(twin) -> None:
    state = twin.read()
    twin.write(Command(state.t, state.sequence, state.t + 0.01, np.full(4, np.nan), np.zeros(4)))
