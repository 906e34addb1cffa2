"""Machines of one and two joints, by the commands: described, checked, identified, floated, and given a motion."""

import json
from pathlib import Path

import pytest
from tests import preloaded
from tests.foreign_machines import ELBOW, ELBOW_AND_ROLL, ONE_JOINT, TWO_JOINTS, answered, written

MACHINES = {"elbow": (ONE_JOINT, ELBOW), "elbow and forearm": (TWO_JOINTS, ELBOW_AND_ROLL)}


def said(folder: Path, *words: str) -> str:
    """Run a command in a folder, and return its output with single spaces."""
    return " ".join(preloaded.exograv(*words, folder=folder, check=True).stdout.split())


def described(folder: Path, machine: str) -> None:
    """Make a machine's folder `mine` by the command and by its builder's answers."""
    text, answers = MACHINES[machine]
    written(folder, text)
    assert "Answer them there" in said(folder, "rig", "new", "machine.urdf", "--out", "mine", "--side", "right")
    answered(folder / "mine", answers)


@pytest.mark.parametrize("machine", MACHINES)
def test_a_machine_of_one_or_two_joints_is_checked_identified_and_floated_like_every_other(
    machine: str, tmp_path: Path
):
    described(tmp_path, machine)
    assert "has no problems" in said(tmp_path, "rig", "check", "mine")
    proposed = said(tmp_path, "demo", "mine", "--seconds", "10", "--json", "demo.json")
    assert "not designed for this machine" in proposed
    left = json.loads((tmp_path / "demo.json").read_text(encoding="utf-8"))["left_over_rms_Nm"]["total"]
    assert left["identified"][0] < 0.5 * left["exo_only"][0]


@pytest.mark.parametrize("machine", ["elbow", pytest.param("elbow and forearm", marks=pytest.mark.long)])
def test_a_machine_of_one_or_two_joints_is_identified_by_a_motion_that_was_designed_for_it(
    machine: str, tmp_path: Path
):
    described(tmp_path, machine)
    said(tmp_path, "rig", "motion", "mine", "--seconds", "1", "--starts", "1", "--write")
    assert "not designed for this machine" not in said(tmp_path, "arm", "identify", "mine", "--seconds", "5")
