"""Elbows are drawn as people have them: with a carrying angle that falls with flexion, and an axis a little off."""

from dataclasses import replace

import numpy as np
import pytest

from exograv.model.rig_settings import ArmKind
from exograv.options import Side
from exograv.rig.twin import Body, Disturbances, Wearer, draw_wearer, parameter_truth
from exograv.rig.twin.wearer.elbow import ElbowForm, draw_elbow, with_elbow
from exograv.rig.twin.wearer.posture import bone_poses, lying_like, usual_axes
from exograv.rig.twin.wearer.regressions import Sex
from exograv.rig.twin.wearer.skeleton import Skeleton

LEVEL = Disturbances.at_level(2)
ROWS = ("carrying_angle", "elbow_axis")
STRAIGHT = LEVEL.without(*ROWS)
NO_TURN = np.zeros(2)
CARRIED = ElbowForm(np.deg2rad(12.0), NO_TURN, NO_TURN)
ALL_TURNED = ElbowForm(np.deg2rad(12.0), np.deg2rad([3.0, -2.0]), np.deg2rad([2.0, -1.0]))

# Cosines of small angles, in double precision.
ROUNDING = 1e-7


def skeleton_of(side: Side, kind: ArmKind = "shoulder_elbow") -> Skeleton:
    return draw_wearer(STRAIGHT, 0, side, kind=kind).arms[0].skeleton


def forearm_line(skeleton: Skeleton, elbow: float) -> np.ndarray:
    q = np.zeros(len(skeleton.freedoms))
    q[3] = elbow
    poses = bone_poses(skeleton, q)
    points = [poses[bone].of(point) for bone, point in (skeleton.elbow, skeleton.wrist)]
    return (points[1] - points[0]) / np.linalg.norm(points[1] - points[0])


@pytest.mark.parametrize(("side", "outward"), [("right", -1.0), ("left", 1.0)])
def test_the_extended_forearm_deviates_outwards_by_the_carrying_angle(side: Side, outward: float):
    line = forearm_line(with_elbow(skeleton_of(side), CARRIED), 0.0)
    np.testing.assert_allclose(
        line, [0.0, outward * np.sin(CARRIED.carrying_angle), -np.cos(CARRIED.carrying_angle)], atol=ROUNDING
    )


def test_the_carrying_angle_falls_with_flexion_to_zero():
    skeleton = with_elbow(skeleton_of("right"), CARRIED)
    # Deviation from the plane of an elbow without carrying angle.
    deviation = [float(np.arcsin(-forearm_line(skeleton, q)[1])) for q in np.linspace(0.0, np.pi, 13)]
    assert deviation[0] == pytest.approx(CARRIED.carrying_angle)
    assert np.all(np.diff(deviation) < 0.0)
    assert deviation[-1] == pytest.approx(0.0, abs=ROUNDING)


def test_a_usual_elbow_leaves_an_arm_as_it_was():
    skeleton = skeleton_of("right", "whole")
    assert with_elbow(skeleton, ElbowForm(0.0, NO_TURN, NO_TURN)) is skeleton


@pytest.mark.parametrize("kind", ["shoulder_elbow", "whole"])
def test_an_oblique_elbow_keeps_lengths_masses_and_moments_of_the_segments(kind: ArmKind):
    before, after = skeleton_of("right", kind), with_elbow(skeleton_of("right", kind), ALL_TURNED)
    for old, new in zip(before.bones, after.bones, strict=True):
        assert new.mass == old.mass
        np.testing.assert_allclose(np.linalg.norm(new.com), np.linalg.norm(old.com))
        np.testing.assert_allclose(np.linalg.eigvalsh(new.inertia), np.linalg.eigvalsh(old.inertia))
    np.testing.assert_allclose(np.linalg.norm(after.bone("hand").origin), before.lengths["forearm"])
    np.testing.assert_allclose(np.linalg.norm(after.mid_forearm[1]), 0.5 * before.lengths["forearm"])


def test_the_wrist_turns_with_the_forearm():
    skeleton = with_elbow(skeleton_of("right", "whole"), ALL_TURNED)
    joints = {joint.name: joint.axis for bone in skeleton.bones for joint in bone.joints}
    line = forearm_line(skeleton, 0.0)
    assert abs(joints["forearm_roll"] @ line) == pytest.approx(1.0)
    assert joints["wrist_flexion"] @ line == pytest.approx(0.0, abs=ROUNDING)


def test_the_hand_of_a_donned_arm_lies_in_line_with_its_forearm():
    skeleton = with_elbow(skeleton_of("right", "whole"), ALL_TURNED)
    q = np.zeros(7)
    q[3] = 0.5 * np.pi
    lying = lying_like(skeleton, q)
    np.testing.assert_allclose(lying[5:], 0.0, atol=1e-5)  # the wrist stays straight


def test_an_oblique_arm_can_lie_along_the_links_of_a_machine():
    skeleton = with_elbow(skeleton_of("right"), ALL_TURNED)
    q = np.deg2rad([20.0, 25.0, 10.0, 70.0])
    lying = lying_like(skeleton, q)
    poses = bone_poses(skeleton, lying)
    elbow, wrist = (poses[bone].of(point) for bone, point in (skeleton.elbow, skeleton.wrist))
    along = (wrist - elbow) / np.linalg.norm(wrist - elbow)
    np.testing.assert_allclose(along, -usual_axes(skeleton, q)["forearm"][:, 2], atol=1e-5)
    assert np.abs(lying - q).max() > np.deg2rad(1.0)


@pytest.mark.parametrize(("sex", "mean", "sd"), [("male", 11.0, 4.0), ("female", 15.0, 5.0)])
def test_carrying_angles_have_the_mean_and_spread_of_their_sex(sex: Sex, mean: float, sd: float):
    drawn = np.rad2deg([draw_elbow(LEVEL, seed, "wearer", sex).carrying_angle for seed in range(2000)])
    assert drawn.min() >= 0.0
    assert drawn.max() <= 25.0
    # Four standard errors of 2000 draws; the clipped ends change mean and SD by less than that.
    assert np.mean(drawn) == pytest.approx(mean, abs=4.0 * sd / np.sqrt(2000))
    assert np.std(drawn) == pytest.approx(sd, rel=4.0 / np.sqrt(2.0 * 2000))


def test_both_arms_of_a_person_carry_outwards_by_the_same_angle():
    right, left = (draw_elbow(LEVEL, 7, owner, "male") for owner in ("wearer", "wearer, second arm"))
    assert right.carrying_angle == left.carrying_angle
    assert not np.array_equal(right.axis_turn, left.axis_turn)


def test_level_0_has_the_usual_elbow():
    assert draw_elbow(Disturbances.at_level(0), 3, "wearer", "female").is_usual


def unturned(wearer: Wearer) -> Wearer:
    """Return the wearer with the forearms of a person without carrying angle."""
    straight = draw_wearer(STRAIGHT, 3, "both").arms
    pairs = zip(wearer.arms, straight, strict=True)
    return replace(wearer, arms=tuple(replace(arm, skeleton=usual.skeleton) for arm, usual in pairs))


def test_the_rows_of_the_elbow_change_no_other_draw_of_a_wearer():
    oblique, straight = (draw_wearer(level, 3, "both") for level in (LEVEL, STRAIGHT))
    assert parameter_truth(oblique) != parameter_truth(straight)
    assert parameter_truth(unturned(oblique)) == parameter_truth(straight)
    assert oblique.lengths_given == straight.lengths_given


@pytest.mark.parametrize(("side", "prefix"), [("right", ""), ("both", "left_")])
def test_the_truth_names_the_carrying_angle_and_the_axis(side: Side, prefix: str):
    calm = LEVEL.without("elbow_axis")
    truth = parameter_truth(draw_wearer(calm, 5, side, Body("male", 1.78, 80.0)))
    angle = draw_elbow(calm, 5, "wearer", "male").carrying_angle
    assert truth[f"{prefix}carrying_angle"] == pytest.approx(angle)
    sign = 1.0 if side == "right" else -1.0
    for component in ("x", "z"):
        assert truth[f"{prefix}elbow_axis_{component}"] == pytest.approx(sign * np.sin(0.5 * angle))
