"""Machine, rig file and wearer are assembled, or refused with the values that disagree."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ModelError
from exograv.model.anthropometry import Body
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig, robots_folder
from exograv.model.support import assemble
from exograv.model.tree import from_pseudo_inertia, inertial_parameters, is_physical, pseudo_inertia

SOURCE = robots_folder() / "recupera_like"


def machine_with(folder: Path, file: str, old: str, new: str) -> RigDescription:
    machine = folder / "machine"
    shutil.copytree(SOURCE, machine)
    text = (machine / file).read_text(encoding="utf-8")
    assert old in text
    (machine / file).write_text(text.replace(old, new), encoding="utf-8")
    return load_rig(str(machine))


@pytest.mark.parametrize(
    ("file", "old", "new", "expected"),
    [
        (
            "right.urdf",
            'name="elbow_flexion"',
            'name="elbow"',
            "right.urdf moves at shoulder_flexion, shoulder_abduction, shoulder_rotation, elbow; rig.toml has",
        ),
        (
            "rig.toml",
            'exo_frame = "forearm_cuff"',
            'exo_frame = "forearm"',
            "No frame 'forearm' in recupera_like_right",
        ),
        ("rig.toml", 'shoulder_centre = "shoulder_centre"', 'shoulder_centre = "neck"', "No frame 'neck'"),
        ("rig.toml", 'mount = "calibration_mount"', 'mount = "hook"', "No frame 'hook'"),
    ],
)
def test_a_rig_file_and_a_urdf_that_disagree_are_refused(tmp_path: Path, file: str, old: str, new: str, expected: str):
    description = machine_with(tmp_path, file, old, new)
    with pytest.raises(ModelError) as caught:
        read_exoskeleton(description)
    assert expected in str(caught.value)


def test_an_unknown_joint_is_answered_with_the_joints_there(assembly):
    with pytest.raises(ModelError, match=r"No joint 'wrist' in recupera_like_right\. Joints there: shoulder_flexion"):
        assembly.exo.index("wrist")


def test_setting_a_length_moves_one_joint_and_nothing_else(assembly):
    tree = read_exoskeleton(assembly.description)
    longer = adjusted(tree, assembly.description, {"upper_arm": 0.31})
    moved = [
        not np.array_equal(a.p_parent_joint, b.p_parent_joint) for a, b in zip(tree.joints, longer.joints, strict=True)
    ]
    assert moved == [False, False, False, True]
    assert longer.joints[3].p_parent_joint[2] == -0.31
    np.testing.assert_array_equal(tree.phi, longer.phi)
    assert tree.joints[3].p_parent_joint[2] == -0.29


def test_the_machine_is_set_to_the_measured_length_and_not_to_the_tables():
    measured = assemble(load_rig("recupera_like"), Body(1.75, 75.0, "male", {"upper_arm": 0.333}))
    assert measured.exo.joints[3].p_parent_joint[2] == -0.333
    assert measured.arm.lengths["upper_arm"] == 0.333


def test_parameters_survive_the_way_through_the_pseudo_inertia():
    phi = inertial_parameters(1.3, np.array([0.02, -0.05, -0.11]), np.diag([0.011, 0.012, 0.004]))
    np.testing.assert_allclose(from_pseudo_inertia(pseudo_inertia(phi)), phi, atol=1e-14)


@pytest.mark.parametrize(
    ("moments", "possible"),
    [((0.01, 0.012, 0.004), True), ((0.01, 0.02, 0.004), False), ((0.01, 0.012, -0.001), False)],
)
def test_a_body_is_physical_when_its_moments_obey_the_triangle(moments: tuple[float, float, float], possible: bool):
    assert is_physical(inertial_parameters(1.0, np.array([0.0, 0.03, -0.1]), np.diag(moments))) is possible


def test_a_body_of_negative_mass_is_not_physical():
    assert not is_physical(-inertial_parameters(1.0, np.zeros(3), np.diag([0.01, 0.012, 0.004])))


def test_a_length_is_set_along_its_axis_on_the_side_where_the_urdf_has_it():
    description = load_rig("nesm_like")
    tree = adjusted(read_exoskeleton(description), description, {"upper_arm": 0.31})
    assert tree.joints[2].p_parent_joint.tolist() == [0.0, 0.31, 0.0]
    description = load_rig("agree_like")
    tree = adjusted(read_exoskeleton(description), description, {"upper_arm": 0.31})
    assert tree.joints[2].p_parent_joint.tolist() == [0.0, -0.31, 0.0]


def test_a_length_along_an_axis_on_which_nothing_lies_is_refused(tmp_path: Path):
    description = machine_with(tmp_path, "rig.toml", 'segment = "upper_arm"  #', 'axis = "x"\nsegment = "upper_arm"  #')
    with pytest.raises(ModelError, match=r"joint 'elbow_flexion' .* is at zero along x of its parent"):
        adjusted(read_exoskeleton(description), description, {"upper_arm": 0.31})
