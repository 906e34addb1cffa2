"""The picture has the lengths and joints of the model, for every machine, side and person."""

import json

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.model.anthropometry import Body, segment_lengths
from exograv.model.description import RigDescription, load_rig, rig_names
from exograv.model.kinematics import body_poses
from exograv.model.scene import SceneDescription, describe_scene
from exograv.model.scene.poses import rotation
from exograv.model.support import put_together

PERSON = Body(1.75, 75.0, "male")
MACHINES = [(name, side) for name in rig_names() for side in load_rig(name).settings.urdf.sides]
MIRRORED = [name for name in rig_names() if {"left", "right"} <= set(load_rig(name).settings.urdf.sides)]
MIRROR = np.diag([1.0, -1.0, 1.0])
WRITTEN_M = 2e-5  # positions are written to 0.01 mm, and a chain adds some of these roundings
SEED = 28


def described(name: str, side: str, person: Body = PERSON) -> tuple[RigDescription, SceneDescription]:
    description = load_rig(name, side)  # pyright: ignore[reportArgumentType] - a side of this machine
    return description, describe_scene(description, person)


def posture(scene: SceneDescription, seed: int = SEED) -> np.ndarray:
    generator = np.random.default_rng(seed)
    return np.array([generator.uniform(joint.lower or 0.0, joint.upper or 0.0) for joint in scene.joints])


def drawn_poses(scene: SceneDescription, q: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Poses of the bodies as the page computes them, from the written numbers alone; the last one is the base."""
    poses = list[tuple[np.ndarray, np.ndarray]]()
    for joint, position in zip(json.loads(scene.text)["joints"], q, strict=True):
        R_parent, p_parent = poses[joint["parent"]] if joint["parent"] >= 0 else (np.eye(3), np.zeros(3))
        R, p = R_parent @ np.reshape(joint["R"], (3, 3)), p_parent + R_parent @ joint["p"]
        poses.append((R @ rotation(np.array(joint["axis"]), position), p))
    return [*poses, (np.eye(3), np.zeros(3))]


def arm_points(scene: SceneDescription, number: int, q: np.ndarray) -> np.ndarray:
    """Shoulder, elbow, wrist and finger tip of an arm that moves with its cuffs [m]."""
    poses = drawn_poses(scene, q)
    return np.array([poses[at.body][0] @ at.p + poses[at.body][1] for at in scene.arms[number].points])


@pytest.mark.parametrize(("name", "side"), MACHINES)
def test_the_picture_has_every_body_where_the_model_of_the_controller_has_it(name: str, side: str):
    description, scene = described(name, side)
    tree = put_together(description, PERSON).exo
    q = ca.SX.sym("q", len(tree.joints))
    at = posture(scene)
    expected = ca.Function("p", [q], [ca.horzcat(*(pose.p for pose in body_poses(tree, q)))])(at).full().T
    drawn = np.array([p for _, p in drawn_poses(scene, at)[:-1]])
    np.testing.assert_allclose(drawn, expected, atol=WRITTEN_M)


@pytest.mark.parametrize(("name", "side"), MACHINES)
def test_arms_have_the_lengths_of_the_person_where_the_cuffs_are_fastened(name: str, side: str):
    description, scene = described(name, side)
    lengths = list(segment_lengths(PERSON).values())
    assert {arm.side for arm in scene.arms} == set(description.arm_sides)
    for number, arm in enumerate(scene.arms):
        points = arm_points(scene, number, description.donning_posture)
        np.testing.assert_allclose(np.linalg.norm(np.diff(points, axis=0), axis=1), lengths, atol=WRITTEN_M)
        assert arm.lengths == pytest.approx(lengths)


@pytest.mark.parametrize(("name", "side"), MACHINES)
def test_forearm_and_hand_keep_their_lengths_in_every_posture_of_the_machine(name: str, side: str):
    _, scene = described(name, side)
    forearm, hand = list(segment_lengths(PERSON).values())[1:]
    for number in range(len(scene.arms)):
        _, elbow, wrist, tip = arm_points(scene, number, posture(scene))
        # The elbow is on the body of the upper arm's cuff: near the machine's axis, not on it.
        assert np.linalg.norm(wrist - elbow) == pytest.approx(forearm, abs=2e-3)
        assert np.linalg.norm(tip - wrist) == pytest.approx(hand, abs=2e-3)


@pytest.mark.parametrize(("name", "side"), MACHINES)
def test_a_joint_moves_its_own_body_and_the_bodies_behind_it_and_no_other(name: str, side: str):
    _, scene = described(name, side)
    rest = posture(scene)
    for moved in range(len(scene.joints)):
        behind = {moved}
        for number, joint in enumerate(scene.joints):
            behind |= {number} if joint.parent in behind else set()
        there = rest.copy()
        there[moved] += 0.3
        before, after = drawn_poses(scene, rest), drawn_poses(scene, there)
        changed = {
            number
            for number, (one, other) in enumerate(zip(before[:-1], after[:-1], strict=True))
            if not (np.allclose(one[0], other[0]) and np.allclose(one[1], other[1]))
        }
        assert changed == behind


@pytest.mark.parametrize("name", MIRRORED)
def test_the_left_picture_is_the_mirrored_right_one(name: str):
    (_, right), (_, left) = described(name, "right"), described(name, "left")
    assert len(right.shapes) == len(left.shapes)
    key = [(shape.kind, shape.role, shape.body, shape.radius) for shape in right.shapes]
    assert sorted(map(str, key)) == sorted(
        str((shape.kind, shape.role, shape.body, shape.radius)) for shape in left.shapes
    )
    at = np.array([joint.rest for joint in right.joints])
    for points in zip(points_in_base(right, at), points_in_base(left, at), strict=True):
        np.testing.assert_allclose(points[0], points[1] @ MIRROR, atol=WRITTEN_M)


def points_in_base(scene: SceneDescription, q: np.ndarray) -> list[np.ndarray]:
    """Middle points of the machine's shapes; a cylinder has no first and second end."""
    poses = drawn_poses(scene, q)
    return [
        np.mean([poses[shape.body][0] @ point + poses[shape.body][1] for point in shape.points], axis=0)
        for shape in scene.shapes
        if shape.role in ("machine", "drive", "cuff") and shape.kind in ("capsule", "cylinder")
    ]


@pytest.mark.parametrize(("name", "side"), MACHINES)
def test_no_drive_is_drawn_inside_the_arm(name: str, side: str):
    description, scene = described(name, side)
    poses = drawn_poses(scene, description.donning_posture)
    for shape in scene.shapes:
        if shape.role != "drive":
            continue
        middle = poses[shape.body][0] @ np.mean(shape.points, axis=0) + poses[shape.body][1]
        for number, arm in enumerate(scene.arms):
            points = arm_points(scene, number, description.donning_posture)
            for start, end, radius in zip(points, points[1:], arm.radius, strict=False):
                share = np.clip((middle - start) @ (end - start) / np.sum((end - start) ** 2), 0.0, 1.0)
                assert np.linalg.norm(middle - start - share * (end - start)) > radius * 0.9


@settings(max_examples=20, deadline=None)
@given(height=st.floats(1.5, 1.95), bmi=st.floats(18.0, 35.0))
def test_a_heavier_person_of_the_same_height_has_thicker_arms_of_the_same_length(height: float, bmi: float):
    light, heavy = (
        described("recupera_like", "right", Body(height, factor * bmi * height**2, "female"))[1].arms[0]
        for factor in (1.0, 1.1)
    )
    assert light.lengths == heavy.lengths
    assert all(thin < thick for thin, thick in zip(light.radius, heavy.radius, strict=True))


def test_the_machine_is_drawn_as_long_as_it_is_set():
    lengths = {"upper_arm": 0.31, "forearm": 0.26, "hand": 0.19}
    scene = describe_scene(load_rig("recupera_like"), PERSON, lengths)
    assert scene.joints[3].p == pytest.approx((0.0, 0.0, -0.31))


def test_a_joint_without_a_motor_is_told_from_a_drive():
    _, passive = described("recupera_like_passive", "right")
    _, driven = described("recupera_like", "right")
    assert not any(joint.has_motor for joint in passive.joints)
    assert not any(shape.role == "drive" for shape in passive.shapes)
    assert all(joint.has_motor for joint in driven.joints)


def test_a_description_has_a_key_that_changes_with_the_person_and_stays_small():
    keys = {described("recupera_like_dual", "both", Body(height, 75.0, "male"))[1].key for height in (1.7, 1.75, 1.7)}
    assert len(keys) == 2
    assert len(described("recupera_like_dual", "both")[1].text) < 16_000
