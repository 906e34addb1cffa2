"""Cuffs of a foreign world stiffen exponentially and slip with dry friction; soft tissue keeps its weight."""

import itertools
from dataclasses import replace

import casadi as ca
import mujoco
import numpy as np
import pytest

from exograv.rig.twin import Disturbances, Examiner, Twin, Wearer, draw_machine, draw_wearer, parameter_truth
from exograv.rig.twin.wearer.strained_cuffs import SLIP_MAX, STRAIN, STRAIN_MAX, StrainedCuffs, draw_strained_cuffs
from exograv.rig.twin.world.scene import build_scene
from exograv.signals import Command

LEVEL = Disturbances.at_level(2)
FOREIGN = Disturbances.at_level(2, "cuffs")
LAW = StrainedCuffs(growth=3.0, slip_force=40.0, stiffness_factor=1.0)
STIFFNESS = 3000.0  # N/m
E_P = ca.SX.sym("e_p")
STRETCHED = ca.Function("stretched", [E_P], [LAW.stretched(E_P)])
WAY, ALONG = ca.SX.sym("way"), ca.SX.sym("along")
SLIPPED = ca.Function("slipped", [WAY, ALONG], [LAW.slipped(WAY, ALONG, STIFFNESS)])

# Two masses on their springs, in a scene whose bones are held by heavy masses.
SHARE_OF_FREQUENCY = 0.02


def force(strain: float) -> float:
    return STIFFNESS * float(STRETCHED(strain))


def test_the_stiffness_has_grown_by_its_factor_at_fifteen_millimetres():
    step = 1e-7
    slope = [(force(x + step) - force(x - step)) / (2.0 * step) for x in (0.0, STRAIN)]
    assert slope[0] == pytest.approx(STIFFNESS, rel=1e-4)
    assert slope[1] == pytest.approx(3.0 * STIFFNESS, rel=1e-4)


@pytest.mark.parametrize("strain", [-0.02, -0.004, 0.006, 0.025])
def test_the_force_follows_the_published_exponential_on_both_sides(strain: float):
    b = np.log(3.0) / STRAIN
    assert force(strain) == pytest.approx(np.sign(strain) * STIFFNESS * (np.exp(b * abs(strain)) - 1.0) / b)


def test_beyond_the_largest_strain_the_stiffness_stays():
    first, second, third = (force(STRAIN_MAX + x) for x in (0.0, 0.01, 0.02))
    assert third - second == pytest.approx(second - first)


@pytest.mark.parametrize("stiffness", [800.0, 3000.0, 1e5])
def test_a_cuff_slips_at_the_strain_that_gives_the_slip_force(stiffness: float):
    assert stiffness * float(STRETCHED(LAW.slip_strain(stiffness))) == pytest.approx(LAW.slip_force)


def test_below_the_slip_force_the_cuff_stays_and_above_it_slips_for_good():
    strain = LAW.slip_strain(STIFFNESS)
    assert float(SLIPPED(0.0, 0.99 * strain)) == 0.0
    way = float(SLIPPED(0.0, strain + 0.004))
    assert way == pytest.approx(0.004)
    assert force(strain + 0.004 - way) == pytest.approx(LAW.slip_force)
    assert float(SLIPPED(way, 0.0)) == way


def test_no_cuff_slips_further_than_fifteen_millimetres():
    assert float(SLIPPED(0.0, 0.2)) == SLIP_MAX
    assert float(SLIPPED(0.0, -0.2)) == -SLIP_MAX


def test_a_slipping_cuff_only_takes_energy_from_a_cycle():
    t = np.linspace(0.0, 6.0 * np.pi, 30001)
    path, way, work = 0.02 * np.sin(t), 0.0, 0.0
    for before, now in itertools.pairwise(path):
        middle = 0.5 * (before + now)
        way = float(SLIPPED(way, middle))
        work -= force(middle - way) * (now - before)
    assert work < -0.1  # J, in three cycles


def test_the_draws_fill_their_ranges():
    drawn = [draw_strained_cuffs(seed) for seed in range(300)]
    assert 2.0 <= min(one.growth for one in drawn) < 2.05
    assert 3.95 < max(one.growth for one in drawn) <= 4.0
    assert 20.0 <= min(one.slip_force for one in drawn) < 21.0
    assert 59.0 < max(one.slip_force for one in drawn) <= 60.0
    shares = [soft.share for seed in range(100) for soft in draw_wearer(FOREIGN, seed).arms[0].soft_tissue.values()]
    assert 0.2 <= min(shares) < 0.21
    assert 0.39 < max(shares) <= 0.4


def rigid(wearer: Wearer) -> Wearer:
    return replace(wearer, arms=tuple(replace(arm, soft_tissue={}) for arm in wearer.arms))


def test_soft_tissue_weighs_what_the_bone_has_lost(rig):
    machine, wearer = draw_machine(rig, LEVEL, 0), draw_wearer(FOREIGN, 0)
    postures = np.array([rig.donning_posture, rig.donning_posture + 0.3])
    soft, stiff = (Examiner(rig, machine, one, postures=postures) for one in (wearer, rigid(wearer)))
    np.testing.assert_allclose(soft.lock_torques(), stiff.lock_torques(), atol=1e-7)
    np.testing.assert_allclose(soft.lock_torques(arm=False), stiff.lock_torques(arm=False), atol=1e-7)
    assert parameter_truth(wearer) == parameter_truth(rigid(wearer))


def test_soft_tissue_has_its_frequency_on_a_bone_that_is_held(rig):
    wearer = draw_wearer(FOREIGN, 3)
    scene = build_scene(rig, draw_machine(rig, LEVEL, 0), wearer)
    model, data = scene.model, scene.data
    assert {soft.frequency for soft in scene.arms[0].soft.values()} == {
        soft.frequency for soft in wearer.arms[0].soft_tissue.values()
    }
    model.opt.gravity[:] = 0.0
    bones = [dof for dof in range(model.nv) if "soft" not in model.joint(int(model.dof_jntid[dof])).name]
    model.dof_armature[bones] = 1e6
    model.dof_damping[:] = 0.0
    for body, soft in scene.arms[0].soft.items():
        mujoco.mj_resetData(model, data)
        dof = int(model.jnt_dofadr[model.body_jntadr[body]])
        data.qpos[dof] = 0.01
        steps = round(0.25 / soft.frequency / model.opt.timestep)
        for _ in range(steps):
            mujoco.mj_step(model, data)
        # After a quarter of its period the mass passes its rest.
        assert abs(data.qpos[dof]) < 0.01 * 2.0 * np.pi * SHARE_OF_FREQUENCY
        assert 4.0 <= soft.frequency <= 8.0


def test_soft_tissue_of_a_resting_twin_hangs_still(rig):
    twin = Twin(rig, draw_machine(rig, FOREIGN, 1), draw_wearer(FOREIGN, 1), 0)
    scene = twin._scene
    soft = [int(scene.model.jnt_dofadr[scene.model.body_jntadr[body]]) for body in scene.arms[0].soft]
    sag = [np.linalg.norm(scene.data.qpos[dof : dof + 3]) for dof in soft]
    for expected, one in zip(scene.arms[0].soft.values(), sag, strict=True):
        assert one == pytest.approx(9.81 / (2.0 * np.pi * expected.frequency) ** 2)
    for _ in range(50):
        state = twin.read()
        twin.write(Command(state.t, state.sequence, state.t + 0.1, np.zeros(4), state.current, np.full(4, 50.0)))
    assert max(np.abs(scene.data.qvel[dof : dof + 3]).max() for dof in soft) < 0.02  # m/s
