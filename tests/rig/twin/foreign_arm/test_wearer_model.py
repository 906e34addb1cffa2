"""A third party's arm in the twin has the masses, inertias and joints of its file, in every notation of the file."""

from dataclasses import replace
from pathlib import Path

import casadi as ca
import mujoco
import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports] - found through a path file
import pytest

from exograv.model.description import load_rig
from exograv.options import Side
from exograv.rig.twin import (
    Disturbances,
    Examiner,
    Twin,
    Wearer,
    WearerModel,
    draw_machine,
    draw_wearer,
    parameter_truth,
    read_wearer_model,
)
from exograv.rig.twin.wearer.arm_bodies import ArmPlace, add_arm, body_name, find_arm
from exograv.rig.twin.wearer.passive import elevation_cosine, follower_paths
from exograv.rig.twin.wearer.posture import bone_poses, fastened_parts, lying_like
from exograv.rig.twin.wearer.segments import Body
from exograv.rig.twin.wearer.skeleton import Skeleton
from exograv.rig.twin.world.scene import build_scene
from exograv.rig.twin.world.statics import Statics
from exograv.signals import Command

EXAMPLES = Path(__file__).parents[4] / "examples" / "wearers"
INERTIA = 1e-9  # kg·m²: MuJoCo turns every inertia to its principal axes and back
PLACE = 1e-9  # m
STAYS = 1e-3  # rad in half a second: MuJoCo's own constraint gives a little in the twin and not at all in the statics
Q = ca.SX.sym("q", 4)
MILD, GOOD = Disturbances.at_level(0), Disturbances.at_level(2)
OPENSIM = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])  # our axes from x forward, y up, z right

WEARERS = Path(__file__).parent / "wearers"
FILES = {
    "arm26": EXAMPLES / "arm26.xml", "rajagopal": EXAMPLES / "rajagopal.xml", "rajagopal_7": EXAMPLES / "rajagopal.xml",
    "girdle": WEARERS / "girdle.xml", "ball": WEARERS / "ball.xml", "sketched": WEARERS / "sketched.urdf",
}  # fmt: skip


def read(told: str, rig: str = "recupera_like", side: Side | None = None) -> WearerModel:
    folder = EXAMPLES if (EXAMPLES / f"{told}.toml").is_file() else WEARERS
    return read_wearer_model(FILES[told], folder / f"{told}.toml", load_rig(rig, side))


def worn(model: WearerModel, disturbances: Disturbances = GOOD, seed: int = 0) -> Wearer:
    return draw_wearer(disturbances, seed, model.skeleton.side, model.body, skeleton=model.skeleton)


def alone(skeleton: Skeleton) -> tuple[mujoco.MjModel, mujoco.MjData, ArmPlace]:
    """Arm in a world of its own, and its indices there."""
    spec, anybody = mujoco.MjSpec(), Body("male", 1.75, 75.0)
    arm = draw_wearer(MILD, 0, skeleton.side, anybody, skeleton=skeleton).arms[0]
    add_arm(spec, arm, np.zeros(3))
    model = spec.compile()
    return model, mujoco.MjData(model), find_arm(model, arm)


def inertia_matrix(model: mujoco.MjModel, data: mujoco.MjData, dofs: np.ndarray) -> np.ndarray:
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M[np.ix_(dofs, dofs)]


FREEDOMS_OF = {
    "arm26": (["shoulder_elevation", "shoulder_adduction", "shoulder_rotation", "elbow_flexion"], {}),
    "rajagopal": (["arm_flex_r", "arm_add_r", "arm_rot_r", "elbow_flex_r"], {"pro_sup_r": np.pi / 2}),
    "rajagopal_7": (
        ["arm_flex_r", "arm_add_r", "arm_rot_r", "elbow_flex_r", "pro_sup_r", "wrist_flex_r", "wrist_dev_r"],
        {},
    ),
}


@pytest.mark.parametrize("told", FREEDOMS_OF)
def test_at_any_posture_the_arm_is_as_heavy_to_move_as_in_its_own_file(told: str):
    skeleton = read(told, "recupera_like_7" if told == "rajagopal_7" else "recupera_like").skeleton
    own = mujoco.MjModel.from_xml_path(str(FILES[told]))
    names, locked = FREEDOMS_OF[told]
    ours, data, place = alone(skeleton)
    theirs, generator = mujoco.MjData(own), np.random.default_rng(0)
    own_dofs = np.array([own.joint(name).dofadr[0] for name in names])
    signs = np.array([1.0, -1.0, 1.0, 1.0, 1.0, 1.0, -1.0])[: len(names)]
    zeros = np.array([0.0, 0.0, 0.0, 0.0, np.pi / 2, 0.0, 0.0])[: len(names)]
    for _ in range(5):
        q = generator.uniform(-0.8, 0.8, len(names))
        data.qpos[place.freedoms] = q
        theirs.qpos[own_dofs] = zeros + signs * q
        for name, angle in locked.items():
            theirs.qpos[own.joint(name).qposadr[0]] = angle
        expected = inertia_matrix(own, theirs, own_dofs) * np.outer(signs, signs)
        np.testing.assert_allclose(inertia_matrix(ours, data, place.freedoms), expected, atol=INERTIA)
        shoulder = own.body("humerus").id
        com = OPENSIM @ (theirs.subtree_com[shoulder] - theirs.xpos[shoulder])
        np.testing.assert_allclose(data.subtree_com[1], com, atol=PLACE)


def test_a_urdf_agrees_with_pinocchio():
    ours, own_data, place = alone(read("sketched").skeleton)
    model = pinocchio.buildModelFromUrdf(str(FILES["sketched"]))
    data, generator = model.createData(), np.random.default_rng(1)
    names, signs = ["swing", "lift", "twist", "bend"], np.array([1.0, 1.0, 1.0, -1.0])
    joints = [model.joints[model.getJointId(name)] for name in names]
    places = [joint.idx_v for joint in joints]
    for _ in range(5):
        q, q_theirs = generator.uniform(-0.8, 0.8, 4), pinocchio.neutral(model)
        for joint, angle in zip(joints, signs * q, strict=True):
            # A continuous joint is a point on the unit circle in Pinocchio.
            q_theirs[joint.idx_q : joint.idx_q + joint.nq] = (
                (angle,) if joint.nq == 1 else (np.cos(angle), np.sin(angle))
            )
        q_theirs[model.joints[model.getJointId("roll")].idx_q] = np.deg2rad(30.0)
        M = np.triu(pinocchio.crba(model, data, q_theirs))
        M = M + np.triu(M, 1).T
        own_data.qpos[place.freedoms] = q
        expected = M[np.ix_(places, places)] * np.outer(signs, signs)
        np.testing.assert_allclose(inertia_matrix(ours, own_data, place.freedoms), expected, atol=INERTIA)


def test_a_girdle_that_follows_its_own_law_takes_the_shoulder_along():
    model = read("girdle")
    own, skeleton = mujoco.MjModel.from_xml_path(str(FILES["girdle"])), model.skeleton
    assert not skeleton.follows_elevation
    theirs, (ours, data, place) = mujoco.MjData(own), alone(skeleton)
    paths = follower_paths(worn(model), Q)
    for q in ([0.0, 0.0, 0.0, 0.0], [1.0, 0.3, -0.4, 1.2]):
        law = 0.02 + np.polyval([0.02, 0.15, 0.03], q[0] - 0.1)  # about the joints' values in the file
        asked = {"flex": q[0], "abduct": q[1], "turn": q[2], "bend": q[3], "rise": law, "open": np.deg2rad(20.0)}
        for name, angle in (asked | {"slide": 0.01}).items():
            theirs.qpos[own.joint(name).qposadr[0]] = angle
        data.qpos[place.freedoms] = q
        data.qpos[place.followers] = np.array(ca.Function("paths", [Q], [paths])(q)).ravel()
        mujoco.mj_forward(own, theirs)
        mujoco.mj_forward(ours, data)
        clavicle = own.body("clavicle").id
        expected = theirs.subtree_com[clavicle] - theirs.xpos[clavicle]
        np.testing.assert_allclose(data.subtree_com[1] - data.xpos[1], expected, atol=PLACE)


def test_what_a_girdle_weighs_is_not_the_arms():
    truth = parameter_truth(worn(read("girdle")))
    assert truth["upper_arm.mass"] == pytest.approx(2.0)
    assert truth["forearm.mass"] == pytest.approx(1.6)
    assert "glenohumeral_slope" not in truth


def test_muscles_and_tendons_are_left_out_and_it_is_said():
    notes = " ".join(read("girdle").notes)
    assert "1 actuators and muscles" in notes
    assert "1 tendons" in notes
    assert "A girdle of bones moves the shoulder" in notes


def test_a_gram_between_two_hinges_adds_its_mass_and_not_an_impossible_inertia(tmp_path: Path, rig):
    arm, place = FILES["girdle"].read_text(encoding="utf-8"), 'pos="0.01 -0.15 0.02">'
    begin = arm.index('<body name="upper"')
    end = arm.index('<joint name="abduct"')
    flex = arm[arm.index('<joint name="flex"') : end]
    gram = f'<body name="between" {place}{flex}<inertial mass="0.001" pos="0 0 0" diaginertia="1 1 1"/>'
    arm = f'{arm[:begin]}{gram}<body name="upper">{arm[end:]}'.replace("</body>" * 5, "</body>" * 6)
    (tmp_path / "model.xml").write_text(arm, encoding="utf-8")
    model = read_wearer_model(tmp_path / "model.xml", WEARERS / "girdle.toml", rig)
    inertias = [np.sum([bone.inertia for bone in one.skeleton.bones], axis=0) for one in (model, read("girdle"))]
    assert sum(bone.mass for bone in model.skeleton.bones) == pytest.approx(4.001)
    np.testing.assert_allclose(*inertias, atol=INERTIA)
    assert "between" in " ".join(model.notes)


def test_held_at_its_lock_torque_an_arm_with_couplings_stays(rig):
    frictionless = MILD.without("coulomb", "viscous", "passive_damping", "cuff_damping")
    wearer = worn(read("girdle"), frictionless)
    twin = Twin(rig, draw_machine(rig, frictionless, 0), wearer, 0)
    before = twin.truth
    for _ in range(500):
        state = twin.read()
        hold = before.tau_motor / before.machine.drives.gain
        twin.write(Command(state.t, state.sequence, state.t + 0.01, before.tau_motor, hold))
    np.testing.assert_allclose(twin.truth.q_arm, before.q_arm, atol=STAYS)


def test_three_hinges_stand_for_a_ball():
    model = read("ball", side="left")
    skeleton = model.skeleton
    assert [joint.name for joint in skeleton.shoulder_joints] == ["flexion", "abduction", "rotation"]
    assert skeleton.is_usual
    assert skeleton.lengths == pytest.approx({"upper_arm": 0.28, "forearm": 0.25, "hand": 0.18})
    truth = parameter_truth(worn(model))
    assert truth["upper_arm.mass"] == pytest.approx(2.0)
    assert truth["upper_arm.mz"] == pytest.approx(-0.28)
    # The hand's broad side, along x, faces forward (our -y is its x): the palm faces the body.
    assert truth["forearm.Iyy"] != pytest.approx(truth["forearm.Ixx"], rel=1e-3)


def test_a_shoulder_told_as_one_joint_is_the_shoulder_told_by_its_hinges(tmp_path: Path, rig):
    told = (WEARERS / "sketched.toml").read_text(encoding="utf-8")
    hinges = told[told.index("flexion =") : told.index("elbow =")]
    shoulder = '[shoulder]\njoints = ["twist", "swing", "lift"]\nzero_deg = [0.0, 0.0, 0.0]\n[freedoms]\n'
    (tmp_path / "map.toml").write_text(told.replace(hinges, "").replace("[freedoms]\n", shoulder), encoding="utf-8")
    as_ball = read_wearer_model(FILES["sketched"], tmp_path / "map.toml", rig).skeleton
    q, found = np.array([0.6, 0.2, -0.3, 1.0]), []
    for skeleton in (read("sketched").skeleton, as_ball):
        model, data, place = alone(skeleton)
        data.qpos[place.freedoms] = q
        found.append(inertia_matrix(model, data, place.freedoms))
    np.testing.assert_allclose(found[0], found[1], atol=INERTIA)


def test_a_shoulder_in_another_order_is_donned_in_the_same_posture():
    usual = draw_wearer(GOOD, 0).arms[0].skeleton
    first, second, third = usual.bones[0].joints
    other = replace(usual, bones=(replace(usual.bones[0], joints=(second, first, third)), *usual.bones[1:]))
    asked, heights = np.array([0.7, 0.5, -0.3, 1.2]), []
    for skeleton in (usual, other):
        model, data, place = alone(skeleton)
        data.qpos[place.freedoms] = lying_like(skeleton, asked)
        mujoco.mj_kinematics(model, data)
        heights.append(data.body("weight_at_right_hand").xpos.copy())
        cosine = ca.Function("cosine", [Q], [elevation_cosine(skeleton, Q)])(lying_like(skeleton, asked))
        assert float(cosine) == pytest.approx(np.cos(0.7) * np.cos(0.5))
    np.testing.assert_allclose(heights[0], heights[1], atol=1e-6)
    assert not other.is_usual


@pytest.mark.parametrize("told", ["rajagopal", "girdle"])
def test_where_a_foreign_arm_rests_does_not_depend_on_what_was_asked_before(rig, told: str):
    wearer, machine = worn(read(told)), draw_machine(rig, GOOD, 0)
    postures = [np.array([1.4, 0.6, -0.5, 1.5]), np.array([0.1, 0.1, 0.4, 0.6])]
    together = Statics(build_scene(rig, machine, wearer), wearer, with_passive=False)
    for q in postures:
        single = Statics(build_scene(rig, machine, wearer), wearer, with_passive=False)
        np.testing.assert_allclose(together.settle(q)[0], single.settle(q)[0], atol=1e-7)


def test_a_foreign_arm_weighs_on_the_locks_what_its_numbers_say(rig):
    examiner = Examiner(rig, draw_machine(rig, MILD, 0), worn(read("arm26"), MILD))
    q = np.array([np.pi / 2, 0.0, 0.0, 0.0])  # straight and level
    share = examiner.lock_torque(q) - examiner.lock_torque(q, arm=False)
    assert share[0] == pytest.approx(10.4, rel=0.02)  # computed from the file's numbers (reference)
    # 2.73 about its own elbow, which is 14 mm beside the machine's.
    assert share[3] == pytest.approx(2.73, rel=0.1)


def test_a_forearm_on_an_oblique_elbow_is_put_along_the_machines(rig):
    skeleton = read("rajagopal").skeleton
    q = lying_like(skeleton, np.array([0.0, 0.0, 0.0, np.pi / 2]))
    poses = bone_poses(skeleton, q)
    elbow, wrist = (poses[bone].of(point) for bone, point in (skeleton.elbow, skeleton.wrist))
    np.testing.assert_allclose((wrist - elbow) / np.linalg.norm(wrist - elbow), [1.0, 0.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(elbow / np.linalg.norm(elbow), [0.0, 0.0, -1.0], atol=1e-5)
    assert abs(q[2]) > np.deg2rad(8.0)  # the wearer turns the upper arm for that


@pytest.mark.parametrize("told", ["arm26", "rajagopal", "girdle", "sketched"])
def test_bones_are_where_mujoco_has_them(told: str):
    skeleton = read(told).skeleton
    model, data, place = alone(skeleton)
    q = np.array([0.9, 0.3, -0.4, 1.1])
    data.qpos[place.freedoms] = q
    paths = follower_paths(worn(read(told), MILD), Q)
    data.qpos[place.followers] = np.array(ca.Function("paths", [Q], [paths])(q)).ravel()
    mujoco.mj_kinematics(model, data)
    for bone, pose in bone_poses(skeleton, q).items():
        np.testing.assert_allclose(data.body(body_name(skeleton, bone)).xpos, pose.p, atol=PLACE)
        np.testing.assert_allclose(data.body(body_name(skeleton, bone)).xmat.reshape(3, 3), pose.R, atol=PLACE)


@pytest.mark.parametrize("told", ["rajagopal", "girdle"])
def test_segments_weigh_the_same_whatever_their_axes(told: str):
    skeleton = read(told).skeleton
    for segment in skeleton.centres:
        own = [bone for bone in skeleton.bones if bone.segment == segment]
        parts = fastened_parts(skeleton, segment)
        assert sum(part.mass for part in parts) == pytest.approx(sum(bone.mass for bone in own))
        spans = [[np.linalg.norm(bone.com) for bone in bones] for bones in (own, parts)]
        np.testing.assert_allclose(spans[0], spans[1])


def test_twice_the_mass_scale_is_twice_the_weight(tmp_path: Path, rig):
    told = (EXAMPLES / "arm26.toml").read_text(encoding="utf-8")
    (tmp_path / "map.toml").write_text("mass_scale = 2.0\n" + told, encoding="utf-8")
    model = read_wearer_model(FILES["arm26"], tmp_path / "map.toml", rig)
    assert parameter_truth(worn(model))["upper_arm.Ixx"] == pytest.approx(
        2.0 * parameter_truth(worn(read("arm26")))["upper_arm.Ixx"]
    )


def test_masses_are_those_of_the_file():
    truth = parameter_truth(worn(read("arm26")))
    assert truth["upper_arm.mass"] == 1.864572
    moment = np.linalg.norm([truth[f"upper_arm.m{axis}"] for axis in "xyz"])
    assert moment == pytest.approx(1.864572 * 0.180496)
    assert truth["forearm.mass"] == 1.534315
    assert truth["forearm.Izz"] == pytest.approx(0.001571)  # about the bone, which is y there


def test_parts_that_are_rigid_together_are_one_segment():
    truth = parameter_truth(worn(read("rajagopal")))
    assert truth["forearm.mass"] == pytest.approx(2 * 0.6075 + 0.4575)
    level = -9.81 * (truth["upper_arm.mz"] + truth["forearm.mz"] - 0.286273 * truth["forearm.mass"])
    assert level == pytest.approx(10.9, abs=0.15)  # reference: 10.9 N·m at the shoulder, off-axis offsets neglected
    assert -9.81 * truth["forearm.mz"] == pytest.approx(2.94, abs=0.05)


def test_lengths_are_told_between_the_models_joint_centres_with_the_levels_error():
    model = read("rajagopal")
    exact = worn(model, MILD)
    assert exact.lengths_given["upper_arm"] == pytest.approx(np.linalg.norm([0.013144, 0.286273, 0.009595]))
    assert set(exact.lengths_given) == {"upper_arm", "forearm"}  # the model's hand has no fingertip
    errors = [worn(model, GOOD, seed).lengths_given["forearm"] - exact.lengths_given["forearm"] for seed in range(60)]
    assert np.std(errors) == pytest.approx(0.006, rel=0.25)
