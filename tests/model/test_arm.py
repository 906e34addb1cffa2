"""The angles of the arm's tree have the same meaning on both sides, and its bodies move as rigid bodies."""

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.dynamics.loop_torque import GRAVITY
from exograv.dynamics.rnea import rnea
from exograv.model.anthropometry import Body
from exograv.model.arm import GRIP_SHARE_OF_HAND, Arm, build_arm, held_weight, is_plausible, translation_of_parameters
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.rig_settings import ArmKind, ArmSide
from exograv.model.tree import inertial_parameters, is_physical

PERSON = Body(1.7, 70.0, "female")
PARITY = 1e-12
MIRROR = np.diag([1.0, -1.0, 1.0])
MIRRORED_PHI = np.tile([1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0], 2)
"""Signs of a body reflected on the xz plane: y of the centre and products with y change sign."""


def point(arm: Arm, x: np.ndarray, frame: str) -> np.ndarray:
    poses = body_poses(arm.tree, ca.SX(ca.DM(x)))
    return np.array(ca.evalf(frame_pose(arm.tree, poses, frame).p)).ravel()


def whole_arm(*sides: ArmSide) -> Arm:
    return build_arm(PERSON, *sides, kind="whole")


def torque(arm: Arm, x: np.ndarray, v: np.ndarray, a: np.ndarray, phi: np.ndarray) -> np.ndarray:
    bodies = ca.SX(ca.DM.zeros(10, len(arm.tree.joints)))
    for i, body in enumerate(arm.bodies):
        bodies[:, body] = ca.SX(ca.DM(phi[10 * i : 10 * (i + 1)]))
    x_, v_, a_, gravity = (ca.SX(ca.DM(u)) for u in (x, v, a, GRAVITY))
    tau = rnea(arm.tree, x_, v_, a_, bodies, gravity)
    return np.array(ca.evalf(tau)).ravel()


@pytest.mark.parametrize(
    ("joint", "forward", "outward", "up"),
    [
        ("arm_flexion", 1, 0, 1),
        ("arm_abduction", 0, 1, 1),
        ("arm_shift", 0, -1, 1),
        ("arm_shift_forward", 1, 0, 0),
        ("arm_shift_outward", 0, 1, 1),
        ("arm_lengthening", 0, 0, -1),
    ],
)
@pytest.mark.parametrize("side", ["right", "left"])
def test_a_positive_joint_moves_the_hand_where_its_name_says(
    side: ArmSide, joint: str, forward: int, outward: int, up: int
):
    arm = build_arm(PERSON, side)
    x = np.zeros(len(arm.tree.joints))
    x[arm.tree.index(joint)] = 0.1
    moved = point(arm, x, "hand") - point(arm, 0 * x, "hand")
    away = -1.0 if side == "right" else 1.0
    np.testing.assert_array_equal(np.sign(moved.round(9)), [forward, away * outward, up])


@pytest.mark.parametrize("side", ["right", "left"])
def test_inward_rotation_turns_the_forearm_to_the_other_side(side: ArmSide):
    arm = build_arm(PERSON, side)
    bent = np.zeros(len(arm.tree.joints))
    bent[arm.tree.index("arm_elbow")] = np.pi / 2
    turned = bent.copy()
    turned[arm.tree.index("arm_rotation")] = 0.3
    moved = point(arm, turned, "hand") - point(arm, bent, "hand")
    assert np.sign(moved[1]) == (1.0 if side == "right" else -1.0)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20)
def test_the_mirrored_arm_costs_the_same_torque(seed: int):
    generator = np.random.default_rng(seed)
    right, left = (build_arm(PERSON, side) for side in ("right", "left"))
    phi = right.phi + np.sqrt(np.diag(right.phi_covariance)) * generator.normal(size=20)
    x, v, a = generator.uniform(-1.0, 1.0, (3, len(right.tree.joints)))
    np.testing.assert_allclose(torque(right, x, v, a, phi), torque(left, x, v, a, MIRRORED_PHI * phi), atol=PARITY)


@given(seed=st.integers(0, 10_000))
@settings(max_examples=20)
def test_the_mirrored_arm_is_in_the_mirrored_place(seed: int):
    right, left = (build_arm(PERSON, side) for side in ("right", "left"))
    x = np.random.default_rng(seed).uniform(-1.0, 1.0, len(right.tree.joints))
    np.testing.assert_allclose(point(left, x, "finger_tip"), MIRROR @ point(right, x, "finger_tip"), atol=PARITY)


@given(seed=st.integers(0, 10_000), z=st.floats(-0.5, 0.5), further=st.floats(-0.5, 0.5))
def test_moving_parameters_is_moving_the_body(seed: int, z: float, further: float):
    generator = np.random.default_rng(seed)
    mass, com, inertia = 1.7, generator.normal(0.0, 0.1, 3), np.diag(generator.uniform(0.01, 0.013, 3))
    moved = translation_of_parameters(z) @ inertial_parameters(mass, com, inertia)
    np.testing.assert_allclose(moved, inertial_parameters(mass, com + np.array([0.0, 0.0, z]), inertia), atol=PARITY)
    both = translation_of_parameters(further) @ translation_of_parameters(z)
    np.testing.assert_allclose(both, translation_of_parameters(further + z), atol=PARITY)


def test_forearm_and_hand_are_one_body_of_both_masses():
    arm = build_arm(PERSON, "right")
    assert arm.phi[10] == pytest.approx(70.0 * (0.0138 + 0.0056))
    assert is_physical(arm.phi[:10])
    assert is_physical(arm.phi[10:])


def test_upper_arm_and_forearm_are_independent_before_anything_is_measured():
    covariance = build_arm(PERSON, "right").phi_covariance
    assert not covariance[:10, 10:].any()
    np.testing.assert_array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance)[0] > -1e-12


def test_a_weight_is_held_between_wrist_and_finger_tip():
    arm = build_arm(PERSON, "right")
    straight = np.zeros(len(arm.tree.joints))
    hand, wrist, tip = (point(arm, straight, name)[2] for name in ("hand", "wrist", "finger_tip"))
    assert tip < hand < wrist
    assert wrist - hand == pytest.approx(GRIP_SHARE_OF_HAND * arm.lengths["hand"])


def test_a_held_weight_adds_to_the_forearm_alone():
    added = held_weight(build_arm(PERSON, "right"), 2.0)
    assert not added[:10].any()
    assert added[10] == 2.0


@pytest.mark.parametrize(
    ("freedom", "forward", "inward"), [("wrist_flexion", 0, 1), ("wrist_deviation", 1, 0)], ids=["flexion", "deviation"]
)
@pytest.mark.parametrize("side", ["right", "left"])
def test_the_wrist_bends_towards_the_palm_and_the_thumb(side: ArmSide, freedom: str, forward: int, inward: int):
    arm = whole_arm(side)
    x = np.zeros(len(arm.tree.joints))
    x[arm.limbs[0].joints[arm.freedoms.index(freedom)]] = 0.1
    moved = (point(arm, x, "finger_tip") - point(arm, 0 * x, "finger_tip"))[:2]
    np.testing.assert_array_equal(np.sign(moved.round(9)), [forward, inward if side == "right" else -inward])


@pytest.mark.parametrize("side", ["right", "left"])
def test_pronation_turns_the_thumb_inwards(side: ArmSide):
    arm = whole_arm(side)
    limb, x = arm.limbs[0], np.zeros(len(arm.tree.joints))
    x[limb.joints[arm.freedoms.index("forearm_roll")]] = 0.3
    thumb = np.array(ca.evalf(body_poses(arm.tree, ca.SX(ca.DM(x)))[limb.bodies["hand"]].R))[:, 0]
    assert np.sign(thumb[1]) == (1.0 if side == "right" else -1.0)


def test_a_whole_arm_with_a_straight_hand_is_the_arm_of_two_bodies():
    whole, two = whole_arm("right"), build_arm(PERSON, "right")
    straight, shorter = (np.zeros(len(arm.tree.joints)) for arm in (whole, two))
    for frame in two.tree.frames:
        np.testing.assert_allclose(point(whole, straight, frame), point(two, shorter, frame), atol=PARITY)
    move = translation_of_parameters(-two.lengths["forearm"])
    np.testing.assert_allclose(whole.phi[10:20] + move @ whole.phi[20:], two.phi[10:], atol=PARITY)


@pytest.mark.parametrize(("kind", "freedoms", "bodies"), [("forearm", 5, 2), ("wrist_flexion", 6, 3)])
@pytest.mark.parametrize("side", ["right", "left"])
def test_an_arm_that_is_moved_less_far_is_a_whole_arm_whose_other_joints_are_straight(
    side: ArmSide, kind: ArmKind, freedoms: int, bodies: int
):
    part, whole = build_arm(PERSON, side, kind=kind), whole_arm(side)
    assert part.freedoms == whole.freedoms[:freedoms]
    assert len(part.segments) == bodies
    n, x = len(part.tree.joints), np.zeros(len(whole.tree.joints))
    x[:n] = np.random.default_rng(1).uniform(-0.5, 0.5, n)
    for frame in ("hand", "mid_forearm", "finger_tip"):
        np.testing.assert_allclose(point(part, x[:n], frame), point(whole, x, frame), atol=PARITY)
    assert part.phi[::10].sum() == pytest.approx(whole.phi[::10].sum())
    outermost = held_weight(part, 2.0)[10 * (bodies - 1)]
    assert outermost == 2.0


def test_two_arms_that_roll_their_forearms_stand_behind_each_other_in_one_tree():
    both = build_arm(PERSON, "right", "left", kind="forearm")
    assert both.limb("left").joints == [12, 13, 14, 16, 17]
    assert both.bodies == (5, 8, 14, 17)


def test_two_arms_are_one_tree_with_two_roots_and_names_that_tell_the_sides():
    both = build_arm(PERSON, "right", "left")
    assert [joint.parent for joint in both.tree.joints].count(-1) == 2
    assert both.freedoms[0] == "right_flexion"
    assert both.freedoms[4] == "left_flexion"
    assert len(set(both.tree.joint_names)) == 16
    assert both.limb("left").joints == [11, 12, 13, 15]
    np.testing.assert_array_equal(both.phi[:20], build_arm(PERSON, "left").phi)


@pytest.mark.parametrize("half_turn", [(np.pi, 0.0), (-np.pi, 0.0), (0.0, np.pi)])
def test_angles_half_a_turn_away_are_out_of_reach(half_turn: tuple[float, float]):
    arm = build_arm(PERSON, "right")
    z = np.array([0.8, 0.4, 0.2, 1.2])
    assert arm.is_reachable(z)
    # The same posture by other angles, or a twisted one.
    turned = np.array([z[0] + half_turn[0], np.pi - z[1] if half_turn[0] else z[1], z[2] + np.pi, z[3]])
    assert not arm.is_reachable(turned)


def test_a_weight_in_a_hand_of_its_own_adds_to_that_hand_alone():
    added = held_weight(whole_arm("right"), 2.0)
    assert not added[:20].any()
    assert added[20] == 2.0
    both = held_weight(build_arm(PERSON, "right", "left"), 2.0)
    assert both[10] == 2.0
    assert not both[20:].any()


@pytest.mark.parametrize("share", [0.39, 1.61])
def test_an_arm_outside_the_plausible_share_of_the_table_is_implausible(share: float):
    arm = build_arm(PERSON, "right", "left")
    assert is_plausible(arm, arm.phi)
    one = arm.phi.copy()
    one[: len(one) // 2] *= share  # the weight of one arm must not hide behind the other
    assert not is_plausible(arm, one)
