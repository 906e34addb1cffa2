"""Machine in MJCF: the URDF that is written from it is the same machine."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from tests.foreign_machines import FOUR, answered, written

from exograv.dynamics.at_rest import carrying_torque
from exograv.errors import ModelError
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import load_rig
from exograv.procedures.machine_tools.new_rig import new_rig
from exograv.procedures.machine_tools.options import NewRigOptions
from exograv.rig.twin.machine.mjcf_machine import urdf_of_mjcf

ARM = """<mujoco model="exo_right">
<compiler angle="degree" autolimits="true" meshdir="nowhere"/>
<default><default class="shoulder"><joint axis="0 -1 0" range="-40 130"/></default></default>
<asset><mesh name="shell" file="missing.stl"/></asset>
<worldbody><body name="stand" pos="0 -0.2 1"><geom type="mesh" mesh="shell"/>
<body name="s1" euler="0 0 0"><inertial pos="-0.05 -0.08 0" mass="2" fullinertia="0.01 0.012 0.005 0.001 0 0"/>
<joint name="shoulder_flexion" class="shoulder"/>
<body name="s2"><inertial pos="-0.05 -0.05 -0.05" mass="1.6" diaginertia="0.01 0.01 0.005" quat="0.9 0.1 0 0.2"/>
<joint name="shoulder_abduction" axis="-1 0 0" range="-15 75"/>
<body name="s3" pos="0.01 0 0.02"><inertial pos="0 -0.05 -0.15" mass="1.2" diaginertia="0.01 0.01 0.002"/>
<joint name="shoulder_rotation" axis="0 0 1" pos="-0.01 0 -0.02" range="-70 70"/>
<body name="s4" pos="-0.01 0 -0.31"><geom type="capsule" fromto="0 -0.03 0 0 -0.03 -0.22" size="0.02" mass="0.6"/>
<joint name="elbow" axis="0 -1 0" range="10 125" ref="10"/><site name="palm" pos="0 0 -0.3"/>
</body></body></body></body></body></worldbody>
<actuator><motor joint="shoulder_flexion" ctrlrange="-60 60"/><motor joint="shoulder_abduction" forcerange="-55 55"/>
<motor joint="shoulder_rotation" ctrlrange="-1 1" gear="30"/><motor joint="elbow" gear="2" forcerange="-15 15"/>
</actuator></mujoco>"""


def test_an_mjcf_without_its_meshes_becomes_a_machine_with_the_same_weight(tmp_path: Path):
    path = written(tmp_path, ARM, "machine.xml")
    found = new_rig(NewRigOptions(path, tmp_path / "mine"), urdf_of_mjcf)
    assert "meshes" not in (found.folder / "machine.urdf").read_text(encoding="utf-8")
    answered(found.folder, FOUR)
    tree = read_exoskeleton(load_rig(str(found.folder)))
    bare = ARM.replace('<geom type="mesh" mesh="shell"/>', "").replace('<mesh name="shell" file="missing.stl"/>', "")
    model = mujoco.MjModel.from_xml_string(bare)
    data = mujoco.MjData(model)
    for q in np.random.default_rng(0).uniform(0.2, 1.0, (5, 4)):
        # The URDF counts from the posture of the file.
        data.qpos[:] = q + model.qpos0
        mujoco.mj_forward(model, data)
        assert carrying_torque(tree, q) == pytest.approx(data.qfrc_bias, abs=1e-6)
    limits = [(joint.lower, joint.upper) for joint in tree.joints]
    assert np.rad2deg(limits) == pytest.approx(np.array([[-40, 130], [-15, 75], [-70, 70], [0, 115]]), abs=1e-6)
    assert [joint.effort for joint in tree.joints] == pytest.approx([60.0, 55.0, 30.0, 30.0])
    assert "palm" in tree.frames


def test_the_inertia_of_a_rotor_in_an_mjcf_is_not_asked_for(tmp_path: Path):
    text = ARM.replace('<default class="shoulder">', '<joint armature="0.081"/><default class="shoulder">')
    found = new_rig(NewRigOptions(written(tmp_path, text, "machine.xml"), tmp_path / "mine"), urdf_of_mjcf)
    assert "drives.rotor_inertia_kgm2" not in [question.key for question in found.questions]
    answered(found.folder, FOUR)
    actuators = load_rig(str(found.folder)).settings.actuators
    assert [one.rotor_inertia_kgm2 for one in actuators] == [0.081] * 4


@pytest.mark.parametrize("mass", ["", ' mass="0.6"'])
def test_a_body_whose_mass_is_in_a_missing_mesh_is_a_fault_with_the_names_of_both(mass: str, tmp_path: Path):
    geom = '<geom type="capsule" fromto="0 -0.03 0 0 -0.03 -0.22" size="0.02" mass="0.6"/>'
    path = written(tmp_path, ARM.replace(geom, f'<geom type="mesh" mesh="shell"{mass}/>'), "machine.xml")
    said = r"link 's4' moves but has no <inertial>; meshes are not read, and its mass is in 'shell' \(missing.stl\)"
    with pytest.raises(ModelError, match=said):
        new_rig(NewRigOptions(path, tmp_path / "mine"), urdf_of_mjcf)


def test_a_mesh_without_mass_is_not_said_to_hold_the_mass_of_its_body(tmp_path: Path):
    geom = '<geom type="capsule" fromto="0 -0.03 0 0 -0.03 -0.22" size="0.02" mass="0.6"/>'
    path = written(tmp_path, ARM.replace(geom, '<geom type="mesh" mesh="shell" mass="0"/>'), "machine.xml")
    with pytest.raises(ModelError, match=r"link 's4' moves but has no <inertial>\. Give its mass"):
        new_rig(NewRigOptions(path, tmp_path / "mine"), urdf_of_mjcf)


def test_an_mjcf_that_mujoco_cannot_read_is_refused_with_its_reason(tmp_path: Path):
    path = written(tmp_path, ARM.replace('flexion" class="shoulder"', 'flexion" class="nobody"'), "machine.mjcf")
    with pytest.raises(ModelError, match=r"MuJoCo cannot read machine.mjcf: .*nobody.* Correct the MJCF"):
        urdf_of_mjcf(path)


def test_a_file_that_an_mjcf_includes_and_that_is_missing_is_asked_for(tmp_path: Path):
    path = written(tmp_path, ARM.replace("<asset>", '<include file="nowhere/scene.xml"/><asset>'), "machine.xml")
    with pytest.raises(ModelError, match=r"nowhere/scene.xml.* Put the included file there\.$"):
        urdf_of_mjcf(path)
