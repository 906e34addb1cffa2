"""A line at the bench acts on one simulated drive, and the refusal of a wrong line lists the commands."""

import io
import json
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import numpy as np
import pytest
from tests.waiting import wait_until

from exograv.errors import RigError
from exograv.model.description import load_rig
from exograv.rig.drive_status import DriveFault
from exograv.rig.drives.settings import load_drives
from exograv.rig.drives.simulated.bench import SimulatedBench
from exograv.rig.drives.simulated.devices import SimulatedDevices
from exograv.rig.drives.simulated.plant import InstructedWearer, Plant
from exograv.rig.twin import Disturbances, Twin, draw_machine

EXAMPLE = Path(__file__).parents[4] / "examples" / "drives" / "udp.toml"


class Front(SimulatedDevices):
    """Mock of the devices that notes all calls."""

    def __init__(self):
        self.done: list[Any] = []

    @property
    def where(self) -> str:
        return "nowhere"

    def _close(self) -> None:
        self.done.append("close")

    def _serve(self, seconds: float) -> None:
        self.done.append(("serve", seconds))

    def _step_drive(self, joint: int) -> None:
        self.done.append(("step", joint))

    def unplug(self, joint: int) -> None:
        self.done.append(("unplug", joint))

    def plug(self, joint: int) -> None:
        self.done.append(("plug", joint))

    def cut(self) -> None:
        self.done.append("cut")

    def mend(self) -> None:
        self.done.append("mend")


class Stage:
    """Bench with the drives of the example."""

    def __init__(self):
        description = load_rig("recupera_like")
        drives = load_drives(EXAMPLE, description)
        machine = draw_machine(description, Disturbances.at_level(0), 0)
        self.plant = Plant(Twin(description, machine, None, 0), drives)
        self.drives = self.plant.each
        self.front, self.said = Front(), list[str]()
        self.bench = SimulatedBench(drives.joints, self.plant, self.front, self.said.append)


@pytest.fixture(scope="module")
def made() -> Stage:
    return Stage()


@pytest.fixture
def stage(made: Stage) -> Stage:
    """Stage in its initial state."""
    for drive in made.drives:
        drive.fault, drive.temperature_C = DriveFault.NONE, 25.0
    made.front.done.clear()
    made.said.clear()
    return made


def test_each_word_reaches_its_drive_alone(stage: Stage):
    for line in ("fail elbow_flexion", "heat shoulder_flexion 80", "unplug elbow_flexion", "plug elbow_flexion", "cut"):
        stage.bench.do(line)
    stage.bench.do("mend")
    assert [drive.fault for drive in stage.drives] == [DriveFault.NONE] * 3 + [DriveFault.INTERNAL]
    assert stage.drives[0].temperature_C == 80.0
    assert stage.front.done == [("unplug", 3), ("plug", 3), "cut", "mend"]


def test_a_weight_hangs_where_it_is_hung(stage: Stage):
    before = stage.plant.measured.q
    stage.bench.do("hang calibration 2")
    for _ in range(200):
        stage.plant.step()
    moved = np.abs(stage.plant.measured.q - before).max()
    stage.bench.do("hang calibration 0")
    assert moved > 0.01


def test_a_report_says_what_every_drive_does(stage: Stage):
    stage.bench.do("press")
    stage.bench.do("report")
    report = json.loads(stage.said[-1])
    assert report["t"] == round(stage.plant.now, 6)
    assert report["joints"]["elbow_flexion"]["fault"] == ["STOP_LINE"]
    assert report["joints"]["elbow_flexion"]["damping"] == 4.0


@pytest.mark.parametrize(
    "line", ["jump", "unplug", "unplug knee", "hang calibration", "heat elbow_flexion warm", "press twice"]
)
def test_what_cannot_be_done_is_refused_with_what_can(stage: Stage, line: str):
    with pytest.raises(RigError, match=r"not a command|No joint 'knee'|not a number"):
        stage.bench.do(line)


def test_typed_lines_are_obeyed_between_steps_and_quit_ends(stage: Stage):
    stage.bench.listen(io.StringIO("nonsense\n\nfail shoulder_flexion\nquit\n"))
    wait_until(stage.bench.obey, "the end", 5.0)
    assert stage.bench.is_done
    assert stage.drives[0].fault is DriveFault.INTERNAL
    assert "is not a command" in stage.said[0]


def test_only_a_person_who_follows_instructions_hears_them(stage: Stage):
    with pytest.raises(RigError, match="Start with --worn --person weak"):
        stage.bench.do("rest 2 0.5")
    person = Mock(spec=InstructedWearer)
    stage.plant.person = person
    for line in ("rest 2 0.5", "attempt", "reach 7 0.1 -0.2 0.3"):
        stage.bench.do(line)
    person.rest.assert_called_once_with(2.0, 0.5)
    person.attempt.assert_called_once_with()
    (target, place), _ = person.reach.call_args
    assert (target, place.tolist()) == (7, [0.1, -0.2, 0.3])


def test_a_therapist_moves_the_whole_machine_or_one_of_two_arms(stage: Stage):
    with pytest.raises(RigError, match="No therapist"):
        stage.bench.do("therapist")
    begun = list[str | None]()
    stage.plant.therapist = begun.append
    for line in ("therapist", "lead left"):
        stage.bench.do(line)
    assert begun == [None, "left"]
