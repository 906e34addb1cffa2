"""The second sample has the published numbers, in the axes of the twin, and every drawn segment could exist."""

import numpy as np
import pytest

from exograv.options import Sex
from exograv.rig.twin import Body, Disturbances, draw_wearer
from exograv.rig.twin.wearer.dumas_sample import DUMAS, STATURE
from exograv.rig.twin.wearer.segments import draw_body, draw_segments, is_physical, mirrored

BODIES = Disturbances.at_level(0, "bodies").without("segment_residual")

# `wojtusch/HuMoD`, SubjectParameterEstimation.m, right arm: mass / body mass; centre / length; moments xx, yy, zz and
# products xy, xz, yz as signed squares of radii / length.
PUBLISHED = {
    ("female", "upper_arm"): (0.022, (-0.073, -0.454, -0.028), (0.33, 0.17, 0.33, 0.03, -0.05, -0.14)),
    ("female", "forearm"): (0.013, (0.021, -0.411, 0.019), (0.26, 0.14, 0.25, 0.1, 0.04, -0.13)),
    ("female", "hand"): (0.005, (0.033, -0.327, 0.021), (0.27, 0.18, 0.25, 0.12, 0.1, -0.12)),
    ("male", "upper_arm"): (0.024, (0.017, -0.452, -0.026), (0.31, 0.14, 0.32, 0.06, 0.05, 0.02)),
    ("male", "forearm"): (0.017, (0.01, -0.417, 0.014), (0.28, 0.11, 0.27, 0.03, 0.02, -0.08)),
    ("male", "hand"): (0.006, (0.035, -0.357, 0.032), (0.26, 0.16, 0.24, 0.09, 0.07, -0.08)),
}
# Mean lengths: 271, 283, 80 mm (men) and 243, 247, 71 mm (women), hands to the knuckles (two digits printed).
TO_KNUCKLES = {"male": (0.080, 0.839), "female": (0.071, 0.768)}


@pytest.mark.parametrize(("sex", "name"), PUBLISHED)
def test_a_person_of_the_sample_has_the_published_segments(sex: Sex, name: str):
    mass, (x, y, z), radii = PUBLISHED[sex, name]
    segment = draw_segments(Body(sex, STATURE[sex], 70.0), BODIES, 3)[name]
    assert segment.mass == pytest.approx(70.0 * mass)
    # The table's axes are forward, up, right; ours are forward, left, up.
    np.testing.assert_allclose(segment.com / segment.length, [x, -z, y], rtol=1e-12)
    xx, yy, zz, xy, xz, yz = (np.sign(r) * r**2 for r in radii)
    wanted = [[xx, -xz, xy], [-xz, zz, -yz], [xy, -yz, yy]]
    np.testing.assert_allclose(segment.inertia / (segment.mass * segment.length**2), wanted, rtol=1e-12)


def test_the_mean_lengths_are_those_of_the_sample():
    assert [DUMAS["male"][name].length for name in ("upper_arm", "forearm")] == [0.271, 0.283]
    assert [DUMAS["female"][name].length for name in ("upper_arm", "forearm")] == [0.243, 0.247]


@pytest.mark.parametrize("sex", ["male", "female"])
def test_the_centre_of_the_hand_agrees_with_the_table_to_the_knuckles(sex: Sex):
    length, share = TO_KNUCKLES[sex]
    hand = DUMAS[sex]["hand"]
    assert -hand.centre[2] * hand.length == pytest.approx(share * length, abs=5e-4)


@pytest.mark.parametrize("level", range(5))
def test_every_wearer_could_exist(level: int):
    for seed in range(40):
        for segment in draw_segments(draw_body(seed), Disturbances.at_level(level, "bodies"), seed).values():
            assert is_physical(segment.mass, segment.inertia)


def test_one_body_has_many_arms_with_the_spread_of_the_regressions():
    man = Body("male", 1.77, 80.5)
    drawn = [draw_segments(man, Disturbances.at_level(0, "bodies"), seed)["forearm"] for seed in range(400)]
    assert np.std(np.log([one.mass for one in drawn])) == pytest.approx(0.101 / 1.175, rel=0.12)
    assert np.mean([one.length for one in drawn]) == pytest.approx(0.283, abs=0.002)


def test_left_arms_are_mirror_images_of_right_ones():
    right, left = (draw_wearer(BODIES, 2, side).arms[0].skeleton.bone("upper_arm") for side in ("right", "left"))
    segment = draw_segments(draw_body(2), BODIES, 2)["upper_arm"]
    assert abs(segment.com[1]) > 0.005
    np.testing.assert_array_equal(right.com, segment.com)
    np.testing.assert_array_equal(left.com, mirrored(segment).com)
    np.testing.assert_array_equal(left.inertia, mirrored(segment).inertia)


def test_only_the_segments_differ_from_home():
    level = Disturbances.at_level(3)
    home, other = draw_wearer(level, 4), draw_wearer(Disturbances.at_level(3, "bodies"), 4)
    assert home.body == other.body
    usual, drawn = ([bone.mass for bone in one.arms[0].skeleton.bones] for one in (home, other))
    assert not np.isclose(usual, drawn).any()
    np.testing.assert_array_equal(home.passive.stiffness, other.passive.stiffness)
    np.testing.assert_array_equal(home.cuffs.stiffness, other.cuffs.stiffness)
    assert other.passive.tissue is None
    assert other.shoulder_path is None
    assert other.cuffs.strained is None
