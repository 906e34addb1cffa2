"""Bring-up of simulated drives in another process: it passes for correct drives, and ends at the first wrong one."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.foreign_machines import ONE_AXIS, answered, task, written

from exograv.live.on_drives.bring_up_command import BringUpResult, run_rig_test
from exograv.live.options import RigTestOptions
from exograv.model.description import load_rig
from exograv.procedures.machine_tools.new_rig import new_rig
from exograv.procedures.machine_tools.options import NewRigOptions
from exograv.rig.twin import Disturbances, draw_machine


def brought_up(folder: Path, **given: Any) -> BringUpResult:
    options = RigTestOptions(simulate=True, by="test", **{"rig": "recupera_like", "level": 0, **given})
    return run_rig_test(options, folder, lambda _text, _share: None, lambda _text: None)


def failed(result: BringUpResult) -> str:
    """Return the step that failed, after a check that no later step was tried."""
    marks = [step.passed for step in result.steps]
    at = marks.index(False)
    assert set(marks[:at]) == {True}
    assert set(marks[at + 1 :]) <= {None}
    assert not result.passed
    return result.steps[at].name + ": " + result.steps[at].what_to_do


def test_an_encoder_that_counts_the_other_way_ends_it_before_any_motor_is_switched_on(tmp_path: Path):
    what = failed(brought_up(tmp_path, wrong_encoder=("shoulder_flexion",)))
    assert "shoulder_flexion: encoder, turned by hand" in what
    assert "Change the sign" in what


@pytest.mark.slow
def test_drives_in_good_order_pass_every_step_and_weights_are_felt_within_the_limit(tmp_path: Path):
    result = brought_up(tmp_path, level=2)
    assert result.passed
    assert all(step.passed for step in result.steps)
    rig = load_rig("recupera_like")
    true = rig.nominal_gain / draw_machine(rig, Disturbances.at_level(2), 0).drives.gain
    felt = np.array([step.value for step in result.steps if "weighs" in step.name], dtype=float)
    np.testing.assert_allclose(felt, true, atol=0.06)


@pytest.mark.slow
@pytest.mark.parametrize(("mass_kg", "upper_deg"), [(5.0, 0.0), (12.0, 40.0)])
def test_a_light_running_machine_passes_at_its_limit_and_fails_if_it_outweighs_its_brakes(
    tmp_path: Path, mass_kg: float, upper_deg: float
):
    text = ONE_AXIS.replace('<mass value="0.9"/>', f'<mass value="{mass_kg}"/>')
    found = new_rig(NewRigOptions(written(tmp_path, text), tmp_path / "mine", side="right"))
    drives = {
        "drives.drive": ['"quasi_direct"'],
        "actuators.range_deg": [f"[-120.0, {upper_deg}]", "[0.0, 130.0]"],
    }
    answered(found.folder, task("[-90.0, 25.0]", "[0.0, 110.0]") | drives)
    result = brought_up(tmp_path / "out", rig=str(found.folder), level=2)
    if upper_deg == 0.0:
        assert result.passed
    else:
        assert "or too weakly for its weight" in failed(result)


@pytest.mark.slow
def test_a_vertical_joint_that_no_weight_loads_is_not_weighed(tmp_path: Path):
    result = brought_up(tmp_path, rig="agree_like", level=2)
    assert result.passed
    assert [step.value for step in result.steps if "is vertical" in step.name] == ["not weighed"]
    assert sum("weighs" in step.name for step in result.steps) == 3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        ({"wrong_sign": ("elbow_flexion",)}, "elbow_flexion"),
        ({"wrong_scale": ("shoulder_flexion:0.5",)}, "shoulder_flexion"),
        ({"wrong_scale": ("elbow_flexion:1.5",)}, "elbow_flexion"),
    ],
)
def test_a_motor_that_turns_the_other_way_or_gives_another_torque_is_found_and_named(
    tmp_path: Path, wrong: dict[str, tuple[str, ...]], named: str
):
    assert named in failed(brought_up(tmp_path, **wrong))
