"""The shipped map fits MyoArm of MyoSuite, where `myo_sim` is installed; the model does not come with exograv."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from exograv.rig.twin import Disturbances, draw_wearer, parameter_truth, read_wearer_model

compose = pytest.importorskip("myo_sim.build.compose")
MAP = Path(__file__).parents[4] / "examples" / "wearers" / "myoarm.toml"


@pytest.mark.filterwarnings("ignore:Attaching a spec")
def test_the_map_finds_the_mass_and_the_carrying_angle_of_myoarm(tmp_path: Path, rig, monkeypatch):
    monkeypatch.chdir(tmp_path)  # MuJoCo leaves a log of its warnings where it runs
    spec = compose.build_spec("myoarm_r")
    own = spec.compile()
    (tmp_path / "myoarm.xml").write_text(spec.to_xml(), encoding="utf-8")
    model = read_wearer_model(tmp_path / "myoarm.xml", MAP, rig)
    wearer = draw_wearer(Disturbances.at_level(0), 0, "right", model.body, skeleton=model.skeleton)
    truth = parameter_truth(wearer)
    whole = own.body_subtreemass[own.body("humphant_r").id]
    assert truth["upper_arm.mass"] + truth["forearm.mass"] == pytest.approx(whole)
    # A joint at its zero turns no body: the elbow's carrying angle follows from three centres and the hinge's axis.
    data = mujoco.MjData(own)
    mujoco.mj_kinematics(own, data)
    shoulder, elbow, wrist = (data.xpos[own.body(name).id] for name in ("humerus_r", "ulna_r", "lunate_r"))
    axis = data.xaxis[own.joint("elbow_flexion_r").id]
    along = [np.arcsin(axis @ line / np.linalg.norm(line)) for line in (elbow - shoulder, wrist - elbow)]
    assert truth["carrying_angle"] == pytest.approx(along[1] - along[0])
    assert truth["upper_arm.Izz"] < 0.01  # kg·m²: two bodies of a gram with 1 kg·m² do not count
