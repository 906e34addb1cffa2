"""Machines of one and two joints: described, checked, identified on the twin, and floated like every other."""

from pathlib import Path

import pytest
from tests.foreign_machines import ELBOW, ELBOW_AND_ROLL, ONE_JOINT, TWO_JOINTS, answered, written

from exograv.laboratory.demo import run_demo
from exograv.laboratory.options import DemoOptions
from exograv.procedures.machine_tools.check_rig import check_rig
from exograv.procedures.machine_tools.design_motion import design_motion
from exograv.procedures.machine_tools.new_rig import new_rig
from exograv.procedures.machine_tools.options import CheckOptions, DesignOptions, NewRigOptions

MACHINES = {"elbow": (ONE_JOINT, ELBOW), "elbow and forearm": (TWO_JOINTS, ELBOW_AND_ROLL)}


def silent(_text: str, _share: float) -> None:
    pass


@pytest.fixture(params=MACHINES)
def rig(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    text, answers = MACHINES[request.param]
    folder = tmp_path / "mine"
    new_rig(NewRigOptions(written(tmp_path, text), folder, "right"))
    answered(folder, answers)
    return str(folder)


def test_a_machine_of_one_or_two_joints_carries_an_arm_that_it_has_identified(rig: str, tmp_path: Path):
    checked = check_rig(CheckOptions(rig), tmp_path, silent)
    assert checked.ok
    assert checked.picture is not None
    result = run_demo(DemoOptions(rig, seconds=20.0), tmp_path, silent)

    total = result.findings.arm.left_over_rms_Nm.total
    assert total.exo_only is not None
    assert total.identified[0] < 0.5 * total.exo_only[0]
    assert result.report.is_file()


def test_a_motion_can_be_designed_for_a_machine_of_one_or_two_joints(rig: str):
    options = DesignOptions(rig, seconds=2.0, starts=1, iterations=3)
    found = design_motion(options, silent).figures
    assert len(found.excitation.centre_deg) == len(found.joints)
    assert found.excitation.source == "designed"
