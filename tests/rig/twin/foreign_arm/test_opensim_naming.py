"""Names and geometry of an OpenSim file say what a map says, on either side and for several families of models."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.rig.twin.foreign_arm.osim_text import Coordinate, Model, Part, TransformAxis, coupling, linear, osim
from tests.rig.twin.foreign_arm.test_opensim_specification import EXAMPLES, assert_same_arm, opensim_of, shipped

from exograv.errors import ConfigError, ModelError
from exograv.laboratory.virtual_laboratory import draw_laboratory
from exograv.model.description import load_rig
from exograv.options import Side
from exograv.rig.twin import WearerModel, read_wearer_model

X, Y, Z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
UPPER = {"mass": 2.0, "com": (0.0, -0.15, 0.0), "inertia": (0.012, 0.004, 0.012, 0.0, 0.0, 0.0)}
LOWER = {"mass": 1.2, "com": (0.0, -0.12, 0.0), "inertia": (0.006, 0.001, 0.006, 0.0, 0.0, 0.0)}
HAND = {"mass": 0.4, "com": (0.0, -0.07, 0.0), "inertia": (0.001, 0.0005, 0.001, 0.0, 0.0, 0.0)}
GRAM = {"mass": 0.0001, "inertia": (0.001, 0.001, 0.001, 0.0, 0.0, 0.0)}
FLEXES = [Coordinate("elbow_flexion", low=0.0, high=2.3)]


def read(model: Model, folder: Path, rig: str = "recupera_like", side: Side | None = None) -> WearerModel:
    path = folder / "model.osim"
    path.write_text(osim(model), encoding="utf-8")
    return read_wearer_model(path, None, load_rig(rig, side))


def turning(body: str, parent: str, axis: tuple, coordinate: str | Coordinate, **other: Any) -> Part:
    one = coordinate if isinstance(coordinate, Coordinate) else Coordinate(coordinate)
    return Part(body, parent, axes=[TransformAxis(one.name, axis)], coordinates=[one], **other)


def with_range(model: Model, body: str, names: dict[str, tuple[float, float]]) -> Model:
    part = next(part for part in model.parts if part.body == body)
    coordinates = [
        replace(one, low=names[one.name][0], high=names[one.name][1]) if one.name in names else one
        for one in part.coordinates
    ]
    return model.with_part(body, coordinates=coordinates)


def rajagopal() -> Model:
    model = opensim_of(shipped("rajagopal"))
    model = with_range(model, "ulna", {"elbow_flex_r": (0.0, 2.6)})
    return with_range(model, "radius", {"pro_sup_r": (0.0, 1.6)})


@pytest.mark.parametrize(("told", "rig"), [("rajagopal", "recupera_like"), ("rajagopal_7", "recupera_like_7")])
def test_the_names_of_rajagopals_arm_stand_for_its_shipped_map(tmp_path: Path, told: str, rig: str):
    found = read(rajagopal(), tmp_path, rig)
    expected = read_wearer_model(EXAMPLES / "rajagopal.xml", EXAMPLES / f"{told}.toml", load_rig(rig))
    assert_same_arm(found, expected)
    assert "Assumed person: male, 1.75 m, 75 kg" in found.notes[0]


def mirrored(model: Model) -> Model:
    """Return the left arm of a right one: z of the model points to the other side of the body."""

    def turned_over(part: Part) -> Part:
        renamed = [replace(one, name=one.name.replace("_r", "_l")) for one in part.coordinates]
        # A mirror keeps the axial vector's component across the mirror, and reverses the two others.
        axes = [
            replace(
                axis, coordinate=axis.coordinate.replace("_r", "_l"), axis=(-axis.axis[0], -axis.axis[1], axis.axis[2])
            )
            for axis in part.axes
        ]
        at, com = ((one[0], one[1], -one[2]) for one in (part.at, part.com))
        xx, yy, zz, xy, xz, yz = part.inertia
        return replace(part, at=at, com=com, inertia=(xx, yy, zz, xy, -xz, -yz), axes=axes, coordinates=renamed)

    return replace(model, parts=[turned_over(part) for part in model.parts])


def test_a_left_arm_is_the_mirror_of_the_right_one(tmp_path: Path):
    right = read(rajagopal(), tmp_path).skeleton
    left = read(mirrored(rajagopal()), tmp_path, side="left").skeleton
    over = np.array([1.0, -1.0, 1.0])
    for bone, other in zip(left.bones, right.bones, strict=True):
        np.testing.assert_allclose(bone.com, over * other.com, atol=1e-9)
        for joint, like in zip(bone.joints, other.joints, strict=True):
            np.testing.assert_allclose(joint.axis, -over * like.axis, atol=1e-9)


def test_both_arms_in_one_file_are_told_apart_by_their_names(tmp_path: Path):
    right, left = rajagopal(), mirrored(rajagopal())
    renamed = [replace(part, body=f"left_{part.body}", parent=f"left_{part.parent}") for part in left.parts[1:]]
    renamed = [replace(part, parent=part.parent.replace("left_torso", "torso")) for part in renamed]
    both = replace(right, parts=[*right.parts, *renamed])
    assert read(both, tmp_path).skeleton.held["upper_arm"] == "humerus"
    assert read(both, tmp_path, side="left").skeleton.held["upper_arm"] == "left_humerus"
    assert "Bodies that belong to no part of this arm are left out: 4." in read(both, tmp_path).notes


def test_a_shoulder_of_one_hinge_becomes_a_ball_and_the_wrist_is_assumed(tmp_path: Path):
    model = Model(
        [
            turning("r_humerus", "ground", (-0.059, 0.002, 0.998), "r_shoulder_elev", at=(0.0, 1.0, 0.2), **UPPER),
            turning("r_forearm", "r_humerus", Z, Coordinate("r_elbow_flex", low=0.0), at=(0.0, -0.29, 0.0), **LOWER),
        ]
    )
    found = read(model, tmp_path)
    assert [joint.name for joint in found.skeleton.shoulder_joints] == ["flexion", "abduction", "rotation"]
    assert found.skeleton.lengths["upper_arm"] == pytest.approx(0.29)
    assert 0.24 < found.skeleton.lengths["forearm"] < 0.3
    notes = " ".join(found.notes)
    assert "The wrist is assumed" in notes
    assert "Three hinges about one centre replace r_shoulder_elev" in notes


def girdled(yaw: float = 0.0) -> Model:
    """Arm whose clavicle and scapula follow the elevation, and whose shoulder has a gram between its hinges."""
    axis, oblique = (0.005, 0.999, 0.042), (-0.998, 0.002, 0.059)
    follows = [Coordinate("clavicle_turn", -0.1, -1e5, 1e5), Coordinate("scapula_turn", 0.1, -1e5, 1e5)]
    return Model(
        [
            turning("thorax", "ground", Y, Coordinate("r_y", yaw)),
            turning("clavicle", "thorax", Y, follows[0], at=(0.006, 0.007, 0.025), mass=0.15),
            turning("scapula", "clavicle", X, follows[1], at=(-0.014, 0.02, 0.136), mass=0.7),
            turning("plane", "scapula", axis, "elv_angle", at=(-0.011, -0.03, 0.005), **GRAM),
            Part("elevation", "plane", **GRAM, coordinates=[Coordinate("shoulder_elv"), Coordinate("back")],
                 axes=[TransformAxis("shoulder_elv", oblique), TransformAxis("back", axis)]),
            turning("humerus", "elevation", axis, "shoulder_rot", **UPPER),
            Part("ulna", "humerus", (0.006, -0.29, -0.012), **LOWER, coordinates=FLEXES,
                 axes=[TransformAxis("elbow_flexion", (0.049, 0.037, 0.998))]),
            turning("radius", "ulna", (-0.017, 0.993, -0.117), Coordinate("pro_sup", low=-1.57), at=(0.0, -0.01, 0.0)),
            Part("proximal_row", "radius", (0.018, -0.242, 0.025), **GRAM,
                 coordinates=[Coordinate("deviation"), Coordinate("flexion")],
                 axes=[TransformAxis("deviation", (-0.5, -0.1, 0.86)), TransformAxis("flexion", (0.96, -0.25, 0.15))]),
            turning("hand", "proximal_row", (0.88, -0.36, 0.29), "wrist_hand_r1", at=(0.004, -0.015, 0.002), **HAND),
        ],
        couplings=[
            coupling("clavicle_turn", "shoulder_elv", linear(-0.24)),
            coupling("scapula_turn", "shoulder_elv", linear(0.3)),
            coupling("back", "elv_angle", linear(-1.0)),
            coupling("wrist_hand_r1", "flexion", linear(0.5)),
        ],
    )  # fmt: skip


@pytest.mark.parametrize("yaw", [0.0, -np.pi / 2])
def test_a_coupled_girdle_stays_as_in_the_hanging_arm_and_it_is_said(tmp_path: Path, yaw: float):
    found = read(girdled(yaw), tmp_path)
    assert [joint.name for joint in found.skeleton.shoulder_joints] == ["flexion", "abduction", "rotation"]
    masses = {
        name: sum(bone.mass for bone in found.skeleton.bones if bone.segment == name)
        for name in ("upper_arm", "forearm")
    }
    assert masses == pytest.approx({"upper_arm": 2.0002, "forearm": 1.6001})
    notes = " ".join(found.notes)
    for words in (
        "shoulder = elv_angle, shoulder_elv, shoulder_rot",
        "pro_sup locked at 0°",
        "back stays as in the hanging arm",
    ):
        assert words in notes
    assert "too small for their inertias" in notes  # the grams count as point masses
    axis = found.skeleton.bones[-1].joints[-1].axis
    np.testing.assert_allclose(axis, [0.049, -0.998, 0.037], atol=0.05)  # a forearm that turns as the humerus does


def test_seven_joints_of_a_coupled_wrist_are_found_by_name(tmp_path: Path):
    found = read(girdled(), tmp_path, "recupera_like_7")
    assert found.skeleton.held["hand"] == "proximal_row"
    joints = {joint.name for bone in found.skeleton.bones for joint in bone.joints}
    assert {"forearm_roll", "wrist_flexion", "wrist_deviation"} <= joints


def test_a_shoulder_that_does_not_hang_at_zero_is_turned_until_it_does(tmp_path: Path):
    model = Model(
        [
            Part("thorax", kind="WeldJoint"),
            turning("clavicle_r", "thorax", Y, Coordinate("SC_y", -0.4), at=(0.02, 0.0, 0.0), mass=0.1),
            turning("scapula_r", "clavicle_r", Z, Coordinate("AC_z", 0.5), at=(0.15, 0.0, 0.0), mass=0.5),
            Part("humerus_r", "scapula_r", (0.02, -0.03, 0.0), **UPPER,
                 coordinates=[Coordinate("GH_y", 0.2), Coordinate("GH_z", 0.1), Coordinate("GH_yy", 0.1)],
                 axes=[TransformAxis("GH_y", Y), TransformAxis("GH_z", Z), TransformAxis("GH_yy", Y)]),
            turning("ulna_r", "humerus_r", X, Coordinate("EL_x", 0.1, 0.1, 2.4), at=(0.0, -0.29, 0.0), **LOWER),
            turning("radius_r", "ulna_r", Y, Coordinate("PS_y", 0.1, 0.1, 2.8), at=(0.0, -0.02, 0.0)),
            Part("hand_r", "radius_r", (0.0, -0.23, 0.0), **HAND, kind="WeldJoint"),
        ]
    )  # fmt: skip
    found = read(model, tmp_path)
    assert "shoulder = GH_y, GH_z, GH_yy, elbow = EL_x, PS_y locked at 90°" in found.notes[0]
    assert found.skeleton.lengths == pytest.approx({"upper_arm": 0.29, "forearm": 0.25}, abs=1e-3)
    elbow = found.skeleton.bones[-1]
    np.testing.assert_allclose(elbow.origin, [0.0, 0.0, -0.29], atol=0.01)


def test_a_model_of_a_whole_person_states_the_mass(tmp_path: Path):
    heavy = Part("pelvis", mass=60.0, kind="WeldJoint")
    model = rajagopal()
    assert "male, 1.75 m, 63.7 kg" in read(replace(model, parts=[heavy, *model.parts]), tmp_path).notes[0]


def test_an_elbow_that_bends_backwards_in_its_file_bends_forwards_here(tmp_path: Path):
    model = with_range(rajagopal(), "ulna", {"elbow_flex_r": (-2.6, 0.0)})
    ulna = next(part for part in model.parts if part.body == "ulna")
    backwards = [replace(axis, axis=tuple(-x for x in axis.axis)) for axis in ulna.axes]
    assert_same_arm(read(model.with_part("ulna", axes=backwards), tmp_path), read(rajagopal(), tmp_path))


def test_without_an_elbow_of_this_side_the_names_that_are_there_are_listed(tmp_path: Path):
    with pytest.raises(
        ModelError, match=r"no coordinate of a left arm is named like an elbow.*arm_flex_r, .*--wearer-map"
    ):
        read(rajagopal(), tmp_path, side="left")


def test_a_locked_shoulder_is_refused_with_the_next_step(tmp_path: Path):
    model = rajagopal()
    humerus = next(part for part in model.parts if part.body == "humerus")
    locked = [replace(one, locked=True) for one in humerus.coordinates]
    with pytest.raises(ModelError, match=r"turns the upper arm\. Unlock the shoulder, or give a map"):
        read(model.with_part("humerus", coordinates=locked), tmp_path)


def test_a_name_on_the_trunk_is_no_wrist(tmp_path: Path):
    model = rajagopal()
    torso = turning("torso", "ground", Z, "flexion")
    model = replace(model, parts=[torso, *model.parts[1:]])
    assert_same_arm(read(model, tmp_path, "recupera_like_7"), read(rajagopal(), tmp_path, "recupera_like_7"))


def test_a_loop_among_other_bodies_is_no_part_of_the_arm(tmp_path: Path):
    first, second = (turning(*pair, X, f"turn_{pair[0]}") for pair in (("femur", "tibia"), ("tibia", "femur")))
    model = replace(rajagopal(), parts=[*rajagopal().parts, first, second])
    assert_same_arm(read(model, tmp_path), read(rajagopal(), tmp_path))


def test_the_laboratory_takes_an_opensim_model_without_a_map(tmp_path: Path):
    path = tmp_path / "model.osim"
    path.write_text(osim(rajagopal()), encoding="utf-8")
    laboratory = draw_laboratory("recupera_like", None, 1, 0, str(path))
    assert laboratory.wearer_model is not None
    assert laboratory.wearer_model.title == "synthetic (OpenSim), mapped by its names"


def test_an_elbow_about_a_vertical_axis_is_refused_with_the_next_step(tmp_path: Path):
    ulna = next(part for part in rajagopal().parts if part.body == "ulna")
    upright = [replace(axis, axis=Y) for axis in ulna.axes]
    with pytest.raises(
        ModelError, match=r"'elbow_flex_r' turns about a vertical axis .*Give a map with --wearer-map\."
    ):
        read(rajagopal().with_part("ulna", axes=upright), tmp_path)


def test_only_an_opensim_model_needs_no_map():
    with pytest.raises(ConfigError, match=r"--wearer-map is missing: .*names of an OpenSim model"):
        draw_laboratory("recupera_like", None, 1, 0, str(EXAMPLES / "arm26.xml"))
