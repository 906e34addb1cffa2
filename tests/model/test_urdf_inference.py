"""The inferences from a machine's URDF agree with its rig file."""

import numpy as np
import pytest

from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig, rig_names
from exograv.model.urdf_inference import arms, place_of, side_of
from exograv.options import Side

MACHINES = [(rig, side) for rig in rig_names() for side in load_rig(rig).settings.urdf.sides]


@pytest.mark.parametrize(("rig", "side"), MACHINES)
def test_the_guesses_are_what_the_rig_file_says(rig: str, side: Side):
    description = load_rig(rig, side)
    tree = read_exoskeleton(description)
    assert side_of(tree) == side
    assert tuple(place_of(name) for name in tree.joint_names) == description.places
    assert tuple(one.place for arm in arms(tree) for one in arm.places) == description.places
    cuffs = []
    for arm, arm_side in zip(arms(tree), description.arm_sides, strict=True):
        assert arm.shoulder_centre == description.shoulder_centre(arm_side)
        assert arm.upper_arm is not None
        cuffs += arm.cuffs
    assert cuffs == [cuff.exo_frame for cuff in description.settings.cuffs]
    for adjustment in description.settings.adjustments:
        if adjustment.segment == "upper_arm":
            lengths = [arm.upper_arm for arm in arms(tree) if arm.upper_arm and arm.upper_arm.joint == adjustment.joint]
            assert [(length.axis, length.metres) for length in lengths] == [(adjustment.axis, adjustment.nominal_m)]


@pytest.mark.parametrize("rig", ["nesm_like", "agree_like"])
def test_shoulder_axes_meet_although_some_are_parallel_in_the_zero_posture(rig: str):
    (arm,) = arms(read_exoskeleton(load_rig(rig)))
    assert arm.meeting is not None
    centre = read_exoskeleton(load_rig(rig)).frame("shoulder_centre").p_body_frame
    np.testing.assert_allclose(arm.meeting, centre, atol=1e-9)


@pytest.mark.parametrize(
    ("name", "place"),
    [("J1", None), ("right_elbow_pitch", "elbow"), ("forearm_roll", "wrist"), ("humeral_rotation", "shoulder")],
)
def test_a_place_is_guessed_only_from_a_word_that_names_it(name: str, place: str | None):
    assert place_of(name) == place
