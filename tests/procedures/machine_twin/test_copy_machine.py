"""The folder of a fitted twin holds the same machine, and nothing else of the folder that it was copied from."""

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.model.description import load_rig, robots_folder
from exograv.model.tree import inertial_parameters
from exograv.procedures.machine_twin.machine_folder import copy_machine
from exograv.rig.twin import Disturbances, draw_machine
from exograv.rig.twin.machine.machine_bodies import machine_spec


def test_a_machine_whose_urdf_is_beside_its_folder_is_the_same_in_its_copy(tmp_path: Path):
    description = load_rig("recupera_like_qdd", "left")
    copy_machine(description, tmp_path / "recupera_like_qdd")
    copied = load_rig(str(tmp_path / "recupera_like_qdd"), "left")
    assert copied.sha256 == description.sha256
    assert load_rig(str(tmp_path / "recupera_like_qdd"), "right").urdf_path.is_file()


def test_a_copy_into_a_folder_of_the_machine_itself_ends_and_leaves_recordings_behind(tmp_path: Path):
    machine = tmp_path / "machine"
    shutil.copytree(robots_folder() / "recupera_like", machine)
    (machine / "out").mkdir()
    for name in ("out/good.csv", "old.mcap"):
        (machine / name).write_bytes(b"0")
    copy_machine(load_rig(str(machine)), machine / "out" / "recupera_like")
    copied = {path.name for path in (machine / "out" / "recupera_like").rglob("*")}
    assert {"rig.toml", "right.urdf"} <= copied
    assert not copied & {"out", "good.csv", "old.mcap"}


def test_a_urdf_that_cannot_be_copied_with_its_name_is_refused(tmp_path: Path):
    machine = tmp_path / "a" / "b" / "machine"
    shutil.copytree(robots_folder() / "recupera_like", machine)
    shutil.copytree(machine, tmp_path / "a", dirs_exist_ok=True)
    text = (machine / "rig.toml").read_text(encoding="utf-8")
    (machine / "rig.toml").write_text(text.replace('"right.urdf"', '"../../right.urdf"'), encoding="utf-8")
    with pytest.raises(ConfigError, match="too far from its folder"):
        copy_machine(load_rig(str(machine)), tmp_path / "out" / "machine")


def test_another_urdf_in_the_place_of_the_copy_is_not_overwritten(tmp_path: Path):
    other = tmp_path / "recupera_like" / "right.urdf"
    other.parent.mkdir()
    other.write_text("<robot/>", encoding="utf-8")
    with pytest.raises(ConfigError, match="where another file is"):
        copy_machine(load_rig("recupera_like_qdd"), tmp_path / "recupera_like_qdd")
    assert other.read_text(encoding="utf-8") == "<robot/>"


def test_a_base_with_mass_does_not_hinder_a_twin_with_links_of_its_own(tmp_path: Path):
    machine = tmp_path / "machine"
    shutil.copytree(robots_folder() / "recupera_like", machine)
    urdf = machine / "right.urdf"
    text = urdf.read_text(encoding="utf-8")
    root = '<link name="base"/>'
    assert root in text
    heavy = (
        '<link name="base"><inertial><mass value="3"/>'
        '<inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )
    urdf.write_text(text.replace(root, heavy), encoding="utf-8")
    weights = []
    for folder in (robots_folder() / "recupera_like", machine):
        description = load_rig(str(folder))
        phi = inertial_parameters(2.0, np.array([0.02, 0.0, -0.1]), 0.02 * np.eye(3))
        links = dict.fromkeys(description.joints, phi)
        drawn = replace(draw_machine(description, Disturbances.at_level(0), 0), links=links)
        weights.append(machine_spec(description, drawn, {}).compile().body_mass.sum())
    assert weights[0] == weights[1] == 2.0 * len(links)
