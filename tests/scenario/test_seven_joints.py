"""With forearm roll and wrist active a hidden arm is identified, floats, and what its hand holds is found.

How it is with more people, and what each joint costs: `benchmarks/further_joints.py`, docs/seven_joints.md.
"""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from exograv.model.description import load_rig
from exograv.study.targets import TARGET_NM

RIG = load_rig("recupera_like_7")
FREEDOMS = ("flexion", "abduction", "rotation", "elbow", "forearm_roll", "wrist_flexion", "wrist_deviation")
DRIFT_DEG = 5.0
"""Beyond the way to its own rest that a floated arm may go: what a wearer who stirs adds."""

CARRIED_SHARE = 0.2
"""Of a weight in the hand that may be felt at shoulder and elbow once it is carried: its interval is ±12 % of 1 kg."""

INTERVALS_SHARE = 0.8
"""Of 38 that must hold the truth in one person: with 95 % each fewer than that are rarer than one in a thousand."""

BENCHMARK = Path(__file__).parents[2] / "benchmarks" / "further_joints.py"


@pytest.fixture(scope="module")
def demo(run_demo):
    return run_demo("demo", "--rig", RIG.name).result


@pytest.mark.slow
def test_every_joint_of_a_whole_arm_ends_within_its_target(demo):
    targets = np.array([TARGET_NM[place] for place in RIG.places])
    assert (np.array(demo["left_over_rms_Nm"]["total"]["identified"]) <= targets).all()
    assert demo["identification"]["time_to_target_s"] < 60.0


@pytest.mark.slow
def test_no_joint_leaves_more_over_than_was_said_to_be_possible(demo):
    said = np.array(demo["possible_left_over_Nm"]["p95"])
    assert (np.array(demo["left_over_rms_Nm"]["total"]["identified"]) <= said).all()
    rows = demo["parameters"]
    assert np.mean([row["ci95"][0] <= row["truth"] <= row["ci95"][1] for row in rows]) >= INTERVALS_SHARE


@pytest.mark.slow
def test_the_whole_arm_floats_where_it_is_put_or_goes_to_its_own_rest(demo):
    truth = {row["name"]: row["truth"] for row in demo["parameters"]}
    rest = np.array([truth[f"{name}.spring_offset"] / truth[f"{name}.stiffness"] for name in FREEDOMS])
    way = np.abs(np.rad2deg(rest - np.mean(RIG.workspace, axis=0)))
    assert (np.array(demo["float"]["drift_deg"]) < way + DRIFT_DEG).all()


@pytest.mark.slow
def test_a_weight_in_a_hand_that_the_machine_moves_is_found_and_carried(demo):
    weight = demo["known_weight"]
    low, high = weight["ci95_kg"]
    assert low <= weight["true_kg"] <= high
    ignored, carried = (np.array(weight["left_over_Nm"][name]) for name in ("ignored", "compensated"))
    assert (carried[:4] < CARRIED_SHARE * ignored[:4]).all()
    assert (carried[4:] <= TARGET_NM["wrist"]).all()


@pytest.mark.slow
def test_a_machine_that_only_rolls_the_forearm_identifies_the_same_person(tmp_path: Path):
    saved = tmp_path / "figures.json"
    command = [sys.executable, str(BENCHMARK), "--seeds", "1012", "--joints", "5", "--seconds", "30"]
    subprocess.run([*command, "--save", str(saved)], check=True, capture_output=True)
    (found,) = json.loads(saved.read_text())
    assert found["names"] == list(RIG.joints[:5])
    assert (np.array(found["left_over_rms_Nm"]) <= 2.0 * np.array(found["targets_Nm"])).all()
    assert sum(found["left_over_rms_Nm"]) < 0.5 * sum(found["by_table_rms_Nm"])
    assert found["weight_ci95_kg"][0] <= 0.5 <= found["weight_ci95_kg"][1]
