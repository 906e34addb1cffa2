"""An unusable OpenSim file is refused in one sentence that says what, where and what to do; nothing else comes out."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.rig.twin.foreign_arm.osim_text import Coordinate, Model, coupling, linear, osim
from tests.rig.twin.foreign_arm.test_opensim_naming import girdled, rajagopal
from tests.rig.twin.foreign_arm.test_opensim_specification import EXAMPLES

from exograv.errors import ExogravError
from exograv.model.description import RigDescription
from exograv.rig.twin import read_wearer_model
from exograv.rig.twin.foreign_arm.wearer_file import SIZE_MAX

ARM = osim(rajagopal())
BOMB = (
    '<?xml version="1.0"?><!DOCTYPE m [<!ENTITY a0 "ha">'
    + "".join(f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(9))
    + "]><OpenSimDocument><Model>&a9;</Model></OpenSimDocument>"
)
EXTERNAL = '<!DOCTYPE m [<!ENTITY x SYSTEM "file:///etc/hostname">]><OpenSimDocument>&x;</OpenSimDocument>'


@pytest.fixture
def refusal(tmp_path: Path, rig: RigDescription, monkeypatch) -> Callable[..., str]:
    """Function that returns the message with which a file is refused."""
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log of its warnings where it runs

    def refusal(text: str | Model, told: Path | None = None) -> str:
        path = tmp_path / "model.osim"
        path.write_text(text if isinstance(text, str) else osim(text), encoding="utf-8")
        with pytest.raises(ExogravError) as caught:
            read_wearer_model(path, told, rig)
        message = str(caught.value)
        assert "\n" not in message
        assert message.endswith(".")
        return message

    return refusal


def broken(old: str, new: str) -> str:
    """Return the text of the arm with its first `old` replaced."""
    assert old in ARM
    return ARM.replace(old, new, 1)


DAMAGED = {
    "broken XML": (ARM[:2000], "is not valid XML"),
    "an empty file": ("", "is not valid XML"),
    "no bodies": (osim(Model([])), "has no bodies in <BodySet>"),
    "no model": ("<OpenSimDocument/>", "has no <Model> in <OpenSimDocument>"),
    "another format": ("<mujoco/>", "has no <Model> in <OpenSimDocument>"),
    "an entity bomb": (BOMB, "declares a document type or entities"),
    "an external entity": (EXTERNAL, "declares a document type or entities"),
    "deep nesting": ("<OpenSimDocument><Model>" + "<a>" * 200_000, "is not valid XML"),
    "a body twice": (broken('<Body name="ulna">', '<Body name="radius">'), "more than one body is called 'radius'"),
    "a coordinate twice": (broken('e="arm_add_r"', 'e="arm_rot_r"'), "more than one coordinate is called 'arm_rot_r'"),
    "an unknown parent": (broken("/bodyset/torso<", "/bodyset/trunk<"), "connects 'trunk', which is no body"),
    "a mass in words": (broken("<mass>2.0325", "<mass>two"), "'humerus': mass is 'two'; it must be one finite number"),
    "an infinite mass": (broken("<mass>2.0325", "<mass>inf"), "'humerus': mass is 'inf'; it must be one finite number"),
    "a mass below zero": (broken("<mass>2.0325", "<mass>-2.0325"), "'humerus' weighs -2.0325 kg"),
    "two numbers for three": (broken("<gravity>0.0 -9.80665 0.0", "<gravity>0.0 -9.8"), "gravity is '0.0 -9.8'"),
    "an axis of zeros": (broken("<axis>0.22", "<axis>0 0 0</axis><axis>0.22"), "has the axis 0 0 0"),
    "no frame": (broken(">ulna_offset</socket_child", "></socket_child"), "has no socket_child_frame"),
    "no coordinate": (broken("<coordinates>elbow_flex_r", "<coordinates>bend"), "the joint has no coordinate 'bend'"),
}


@pytest.mark.parametrize(("text", "words"), DAMAGED.values(), ids=DAMAGED.keys())
def test_a_damaged_file_is_refused(refusal, text: str, words: str):
    assert words in refusal(text)


def changed(**parts: dict) -> Model:
    model = rajagopal()
    for body, changes in parts.items():
        model = model.with_part(body, **changes)
    return model


def coupled(*pairs: tuple[str, str], law: str | None = None) -> Model:
    return replace(rajagopal(), couplings=[coupling(*pair, law or linear()) for pair in pairs])


@pytest.mark.parametrize(
    ("model", "words"),
    [
        (changed(ulna={"kind": "EllipsoidJoint"}), "'ulna_joint' is a EllipsoidJoint, which exograv cannot represent"),
        (changed(ulna={"kind": "UniversalJoint"}), "UniversalJoint with 1 coordinates; it needs 2"),
        (changed(ulna={"extra": "<reverse>true</reverse>"}), "'ulna_joint' is reversed. Exchange its parent"),
        (changed(humerus={"parent": "hand"}), "is not connected to the ground"),
        (coupled(("pro_sup_r", "elbow_flex_r arm_rot_r")), "follows 2 coordinates"),
        (coupled(("pro_sup_r", "nowhere")), "'nowhere', which does not exist"),
        (coupled(("pro_sup_r", "elbow_flex_r"), law="<Sine/>"), "class Sine is not known"),
        (coupled(("pro_sup_r", "wrist_dev_r"), ("wrist_dev_r", "pro_sup_r")), "follows it in turn"),
        (changed(ulna={"inertia": (3.0, 3.0, 3.0, 0.0, 0.0, 0.0)}), "'ulna' weighs 0.608 kg and has an inertia of"),
        (changed(ulna={"inertia": (0.1, 0.001, 0.001, 0.0, 0.0, 0.0)}), "inertia must satisfy"),
        (changed(ulna={"at": (0.0, -286.0, 0.0)}), "upper_arm is 286 m long"),
    ],
)
def test_an_arm_that_cannot_be_represented_is_refused(refusal, model: Model, words: str):
    assert words in refusal(model)


def test_a_joint_of_another_part_of_the_body_may_be_of_any_class(tmp_path: Path, rig):
    leg = replace(
        rajagopal().parts[1], body="femur", parent="ground", kind="EllipsoidJoint", coordinates=[Coordinate("knee")]
    )
    path = tmp_path / "model.osim"
    path.write_text(osim(replace(rajagopal(), parts=[*rajagopal().parts, leg])), encoding="utf-8")
    assert "Bodies that belong to no part of this arm are left out: 1." in read_wearer_model(path, None, rig).notes


def test_a_scapula_on_an_ellipsoid_is_refused_with_its_name(refusal):
    message = refusal(girdled().with_part("scapula", kind="ScapulothoracicJoint"))
    assert "joint 'scapula_joint' is a ScapulothoracicJoint, which exograv cannot represent" in message
    assert "Replace it in OpenSim, or use a model without it." in message


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"arm_flex_r"', '"arm_flexion"', ("no joint 'arm_flexion'", "arm_add_r, arm_rot_r")),
        ('"humerus"', '"humerous"', ("no body 'humerous'", "torso, humerus, ulna")),
        ('hand = "hand"', 'hand = "torso"', ("torso",)),
    ],
)
def test_a_map_that_does_not_fit_an_opensim_file_is_refused(refusal, tmp_path: Path, old: str, new: str, words: tuple):
    told = (EXAMPLES / "rajagopal.toml").read_text(encoding="utf-8")
    assert old in told
    (tmp_path / "map.toml").write_text(told.replace(old, new), encoding="utf-8")
    message = refusal(rajagopal(), tmp_path / "map.toml")
    for word in words:
        assert word in message


def test_a_huge_file_is_refused_before_it_is_read(tmp_path: Path, rig):
    path = tmp_path / "model.osim"
    with path.open("wb") as file:
        file.truncate(SIZE_MAX + 1)
    with pytest.raises(ExogravError, match=r"larger than 20 MB\. Give the MJCF, URDF or OpenSim model"):
        read_wearer_model(path, None, rig)


@pytest.mark.parametrize("seed", range(3))
def test_a_file_with_random_damage_is_read_or_refused_in_one_line(tmp_path: Path, rig, monkeypatch, seed: int):
    monkeypatch.chdir(tmp_path)
    generator, path = np.random.default_rng(seed), tmp_path / "model.osim"
    text = osim(girdled())
    pieces = text.split("\n")
    refused = 0
    for _ in range(40):
        lines = list(pieces)
        for _ in range(int(generator.integers(1, 3))):
            k = int(generator.integers(0, len(lines)))
            match int(generator.integers(0, 4)):
                case 0:
                    del lines[k]
                case 1:
                    lines[k] = lines[int(generator.integers(0, len(lines)))]
                case 2:
                    lines[k] = lines[k].replace("0", str(generator.choice(["-", "9e9", "nan", "", "x"])))
                case _:
                    lines[k] = lines[k].replace("humerus", "ground").replace("Linear", "Step")
        path.write_text("\n".join(lines), encoding="utf-8")
        message = ""
        try:
            read_wearer_model(path, None, rig)
        except ExogravError as error:
            message = str(error)
        assert "\n" not in message
        refused += bool(message)
    assert refused
