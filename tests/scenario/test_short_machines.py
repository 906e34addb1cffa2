"""Machines of one and two joints, by the commands: described, checked, identified, floated, and given a motion."""

import json
from pathlib import Path

import pytest
from tests import preloaded
from tests.foreign_machines import ELBOW, ELBOW_AND_ROLL, ONE_JOINT, TWO_JOINTS, answered, written

MACHINES = {"elbow": (ONE_JOINT, ELBOW), "elbow and forearm": (TWO_JOINTS, ELBOW_AND_ROLL)}


@pytest.mark.parametrize("machine", MACHINES)
def test_a_machine_of_one_or_two_joints_runs_like_every_other(machine: str, tmp_path: Path):
    text, answers = MACHINES[machine]
    written(tmp_path, text)

    def said(*words: str) -> str:
        return preloaded.exograv(*words, folder=tmp_path, check=True).stdout

    assert "Answer them there" in said("rig", "new", "machine.urdf", "--out", "mine", "--side", "right")
    answered(tmp_path / "mine", answers)
    assert "has no problems" in said("rig", "check", "mine")
    proposed = said("demo", "mine", "--seconds", "10", "--json", "demo.json")
    assert "not designed for this machine" in " ".join(proposed.split())
    left = json.loads((tmp_path / "demo.json").read_text(encoding="utf-8"))["left_over_rms_Nm"]["total"]
    assert left["identified"][0] < 0.5 * left["exo_only"][0]
    said("rig", "motion", "mine", "--seconds", "1", "--starts", "1", "--write")
    designed = said("arm", "identify", "mine", "--seconds", "5")
    assert "not designed for this machine" not in " ".join(designed.split())
