"""Arms of seven freedoms and pairs of arms conserve energy, mirror each other and are independent."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest

from exograv.model.description import load_rig
from exograv.model.rig_settings import ArmKind
from exograv.rig.twin import Disturbances, Examiner, Twin, draw_machine, draw_wearer, parameter_truth
from exograv.rig.twin.wearer.arm_bodies import add_arm, find_arm
from exograv.rig.twin.wearer.passive import SHIFT_STIFFNESS
from exograv.rig.twin.world.scene import build_scene
from exograv.rig.twin.world.statics import Statics
from exograv.signals import Command

MILD = Disturbances.at_level(0)
FRICTIONLESS = MILD.without("coulomb", "viscous", "passive_damping", "cuff_damping")
GOOD = Disturbances.at_level(2)
MIRROR = 1e-9  # rad: rounding alone, over a quarter of a second
APART = 1e-12  # rad: both arms' rests are found together, to rounding
WAY = 1e-7  # rad: twice the tolerance of a rest over the cuffs' least stiffness
ENERGY = 0.02  # J, of some 10 J that the fall turns into motion: the step's own error
OTHER_MACHINES = ["recupera_like_7", "recupera_like_dual", "nesm_like", "agree_like"]


def draw_twin(rig: str, disturbances: Disturbances, seed: int = 0, **options) -> Twin:
    description = load_rig(rig)
    wearer = draw_wearer(disturbances, seed, description.side, kind=description.settings.wearer.arm)
    return Twin(description, draw_machine(description, disturbances, seed), wearer, seed, **options)


def let_go(twin: Twin, seconds: float, current: float = 0.0) -> None:
    n = len(twin.joints)
    for _ in range(round(seconds / twin.period_s)):
        state = twin.read()
        twin.write(Command(state.t, state.sequence, state.t + 0.01, np.zeros(n), np.full(n, current)))


def energy(twin: Twin) -> float:
    """Energy of gravity, motion, cuffs and shoulder paths [J], in NumPy on MuJoCo's positions; at level 0."""
    scene, wearer = twin._scene, twin.truth.wearer
    assert wearer is not None
    model, data = scene.model, mujoco.MjData(scene.model)
    model.opt.enableflags |= mujoco.mjtEnableBit.mjENBL_ENERGY
    data.qpos[:], data.qvel[:] = scene.data.qpos, scene.data.qvel
    mujoco.mj_forward(model, data)
    total = float(data.energy.sum()) + 0.5 * SHIFT_STIFFNESS * float((data.qpos[scene.followers] ** 2).sum())
    for place in scene.cuffs:
        R_exo, R_arm = (data.xmat[body].reshape(3, 3) for body in (place.exo_body, place.arm_body))
        e_p = R_exo.T @ (data.xpos[place.arm_body] + R_arm @ place.p_arm - data.xpos[place.exo_body])
        S = 0.5 * (R_exo.T @ R_arm @ place.R_arm - (R_exo.T @ R_arm @ place.R_arm).T)
        e = np.array([*e_p, S[2, 1], S[0, 2], S[1, 0]])
        total += 0.5 * float(e @ (place.holds * wearer.cuffs.stiffness * e))
    return total


@pytest.mark.parametrize("rig", ["recupera_like_7", "recupera_like_dual"])
def test_unpowered_and_frictionless_every_arm_keeps_its_energy(rig: str):
    description = load_rig(rig)
    lower, upper = description.workspace
    twin = draw_twin(rig, FRICTIONLESS, start_posture=0.5 * (lower + upper))
    let_go(twin, 0.02)
    energies = []
    for _ in range(12):
        let_go(twin, 0.02)
        energies.append(energy(twin))
    assert np.ptp(energies) < ENERGY
    assert np.abs(twin.truth.v_arm).max() > 1.0


@pytest.mark.parametrize("rig", OTHER_MACHINES)
@pytest.mark.parametrize("level", [0, 2, 4])
def test_every_machine_survives_shaking(rig: str, level: int):
    twin = draw_twin(rig, Disturbances.at_level(level), seed=level)
    generator, drives = np.random.default_rng(level), twin.truth.machine.drives
    q = twin.read().q
    for _ in range(200):
        state = twin.read()
        tau = generator.normal(0.0, 0.03, len(q)) * drives.torque_max - drives.torque_max * (state.q - q)
        twin.write(Command(state.t, state.sequence, state.t + 0.01, tau, tau / drives.gain))
    assert np.abs(twin.truth.v).max() < 30.0
    assert np.abs(twin.truth.v_arm).max() < 30.0


def test_two_arms_that_are_alike_mirror_each_other():
    twin = draw_twin("recupera_like_dual", MILD)
    let_go(twin, 0.25, 0.5)
    truth = twin.truth
    np.testing.assert_allclose(truth.q[:4], truth.q[4:], atol=MIRROR)
    np.testing.assert_allclose(truth.q_arm[:4], truth.q_arm[4:], atol=MIRROR)
    assert np.abs(truth.v_arm).max() > 0.1


def test_what_one_arm_is_and_does_does_not_reach_the_other():
    description, machine = load_rig("recupera_like_dual"), draw_machine(load_rig("recupera_like_dual"), GOOD, 0)
    person = draw_wearer(GOOD, 0, "both")
    right, left = person.arms
    heavy = replace(left.skeleton, bones=tuple(replace(b, mass=2.0 * b.mass) for b in left.skeleton.bones))
    other = replace(person, arms=(right, replace(left, skeleton=heavy)))
    truths = []
    for wearer, voluntary in ((person, 0.0), (other, 3.0)):
        twin = Twin(description, machine, wearer, 0)
        twin.tau_voluntary[4:] = voluntary
        twin.write(Command(0.0, 0, 1.0, np.zeros(8), np.zeros(8)))
        let_go(twin, 0.2)
        truths.append(twin.truth)
    np.testing.assert_allclose(truths[0].q_arm[:4], truths[1].q_arm[:4], atol=APART)
    np.testing.assert_allclose(truths[0].q[:4], truths[1].q[:4], atol=APART)
    assert (truths[0].q_arm[4:] != truths[1].q_arm[4:]).all()


def test_both_arms_stir_on_their_own():
    twin = draw_twin("recupera_like_dual", GOOD)
    let_go(twin, 0.01)
    muscles = twin.truth.tau_muscle
    assert (muscles[:4] != muscles[4:]).all()


def test_a_persons_arms_are_as_long_and_nearly_as_heavy_as_each_other():
    ratios = []
    for seed in range(80):
        right, left = (arm.skeleton for arm in draw_wearer(GOOD, seed, "both").arms)
        assert right.lengths == left.lengths
        ratios.append(left.bone("forearm").mass / right.bone("forearm").mass)
    assert np.std(np.log(ratios)) == pytest.approx(0.02, rel=0.25)


def test_the_first_arm_of_two_is_the_arm_of_a_machine_for_one():
    alone, first = draw_wearer(GOOD, 5).arms[0], draw_wearer(GOOD, 5, "both").arms[0]
    np.testing.assert_array_equal(alone.donning_offset, first.donning_offset)
    np.testing.assert_array_equal(alone.passive.stiffness, first.passive.stiffness)
    assert alone.skeleton.bone("upper_arm").mass == first.skeleton.bone("upper_arm").mass


def test_parameters_of_two_arms_have_names_that_tell_them_apart():
    truth = parameter_truth(draw_wearer(GOOD, 1, "both"))
    assert truth["right_flexion.stiffness"] != truth["left_flexion.stiffness"]
    assert {name.split("_", 1)[0] for name in truth} == {"right", "left"}


def test_a_hand_of_its_own_is_what_the_forearm_has_no_longer():
    one, whole = (parameter_truth(draw_wearer(GOOD, 1, kind=kind)) for kind in ("shoulder_elbow", "whole"))
    assert one["forearm.mass"] == pytest.approx(whole["forearm.mass"] + whole["hand.mass"])
    below = draw_wearer(GOOD, 1).arms[0].skeleton.lengths["forearm"]
    moved = whole["forearm.mz"] + whole["hand.mz"] - below * whole["hand.mass"]
    assert one["forearm.mz"] == pytest.approx(moved)
    assert {"forearm_roll.stiffness", "wrist_flexion.damping", "wrist_deviation.spring_offset"} <= set(whole)


def test_a_person_whose_wrist_is_held_straight_is_otherwise_the_same_person():
    whole = draw_wearer(GOOD, 1, kind="whole").arms[0]
    kinds: tuple[ArmKind, ...] = ("forearm", "wrist_flexion")
    for kind, freedoms in zip(kinds, (5, 6), strict=True):
        part = draw_wearer(GOOD, 1, kind=kind).arms[0]
        assert part.skeleton.freedoms == whole.skeleton.freedoms[:freedoms]
        for name in ("stiffness", "neutral", "damping"):
            np.testing.assert_array_equal(getattr(part.passive, name), getattr(whole.passive, name)[:freedoms])
        np.testing.assert_array_equal(part.donning_offset, whole.donning_offset)
        assert [bone.mass for bone in part.skeleton.bones] == [bone.mass for bone in whole.skeleton.bones]
        assert ("hand" in part.skeleton.centres) == (kind == "wrist_flexion")


@pytest.mark.parametrize("side", ["right", "left"])
@pytest.mark.parametrize(
    ("freedom", "moves"),
    [
        ("flexion", (1, 0)), ("abduction", (0, -1)), ("elbow", (1, 0)), ("wrist_flexion", (0, 1)),
        ("wrist_deviation", (1, 0)),
    ],
)  # fmt: skip
def test_the_hand_of_a_hanging_arm_goes_where_each_freedom_says(side, freedom: str, moves: tuple[int, int]):
    # x forward, y left; for the left arm sideways is the other way round.
    person, spec = draw_wearer(MILD, 0, side, kind="whole"), mujoco.MjSpec()
    add_arm(spec, person.arms[0], np.zeros(3))
    model = spec.compile()
    data = mujoco.MjData(model)
    place = find_arm(model, person.arms[0])
    before, after = [], []
    for angle, found in ((0.0, before), (0.01, after)):
        data.qpos[place.freedoms[place.skeleton.freedoms.index(freedom)]] = angle
        mujoco.mj_kinematics(model, data)
        found.append(data.body(f"weight_at_{side}_hand").xpos.copy())
    moved = (after[0] - before[0])[:2]
    outward = 1.0 if side == "right" else -1.0
    assert np.argmax(np.abs(moved)) == np.argmax(np.abs(moves))
    assert float(moved @ (moves[0], outward * moves[1])) > 0.0


@pytest.mark.parametrize("rig", OTHER_MACHINES)
def test_where_the_arm_rests_does_not_depend_on_what_was_asked_before(rig: str):
    description = load_rig(rig)
    machine = draw_machine(description, GOOD, 1)
    wearer = draw_wearer(GOOD, 1, description.side, kind=description.settings.wearer.arm)
    lower, upper = description.workspace
    postures = [lower + share * (upper - lower) for share in (0.9, 0.2, 0.6)]
    together = Statics(build_scene(description, machine, wearer), wearer, with_passive=False)
    for q in postures:
        alone = Statics(build_scene(description, machine, wearer), wearer, with_passive=False)
        np.testing.assert_allclose(together.settle(q)[0], alone.settle(q)[0], atol=WAY)


@pytest.mark.parametrize("rig", OTHER_MACHINES)
def test_the_arm_follows_small_steps_of_the_machine_by_small_steps(rig: str):
    description = load_rig(rig)
    wearer = draw_wearer(GOOD, 2, description.side, kind=description.settings.wearer.arm)
    statics = Statics(build_scene(description, draw_machine(description, GOOD, 2), wearer), wearer, with_passive=False)
    lower, upper = description.workspace
    way = [statics.settle(lower + share * (upper - lower))[0] for share in np.linspace(0.1, 0.9, 25)]
    longest = np.abs(upper - lower).max() / 25
    assert np.abs(np.diff(way, axis=0)).max() < 3.0 * longest


def test_weights_hang_in_either_hand_and_at_every_mount_by_name():
    twin = draw_twin("recupera_like_dual", MILD)
    masses = twin._scene.model.body_mass
    for mount in ("right_hand", "left_hand", "calibration"):
        before = masses.sum()
        twin.hang(mount, 1.0)
        assert masses.sum() - before == pytest.approx(1.0)
    before = masses.sum()
    twin.hang("hand", 0.0)  # the right hand
    assert masses.sum() - before == pytest.approx(-1.0)


def test_a_direction_that_the_machine_leaves_free_carries_nothing(rig):
    cuffs = [cuff.model_copy(update={"along_N_per_mm": 0.0}) for cuff in rig.settings.cuffs]
    sleeves = replace(rig, settings=rig.settings.model_copy(update={"cuffs": cuffs}))
    scene = build_scene(sleeves, draw_machine(rig, GOOD, 0), draw_wearer(GOOD, 0))
    assert all(place.holds.tolist() == [1.0, 1.0, 0.0, 1.0, 1.0, 1.0] for place in scene.cuffs)


def test_seven_joints_carry_the_weight_of_the_whole_arm():
    description, wearer = load_rig("recupera_like_7"), draw_wearer(MILD, 0, kind="whole")
    examiner = Examiner(description, draw_machine(description, MILD, 0), wearer)
    q = np.zeros(7)
    q[0] = 0.5 * np.pi  # straight and level: flexion carries all first moments
    share = examiner.lock_torque(q) - examiner.lock_torque(q, arm=False)
    truth, lengths = parameter_truth(wearer), wearer.arms[0].skeleton.lengths
    upper, fore = lengths["upper_arm"], lengths["forearm"]
    moments = truth["upper_arm.mz"] + truth["forearm.mz"] + truth["hand.mz"]
    moments -= upper * (truth["forearm.mass"] + truth["hand.mass"]) + fore * truth["hand.mass"]
    assert share[0] == pytest.approx(-9.81 * moments, rel=0.02)  # even the stiffest cuffs sag a little
