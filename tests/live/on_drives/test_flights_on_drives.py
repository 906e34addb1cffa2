"""Commands over simulated drives in another process: an arm is kept and checked again, a session is run.

The commands hold no twin: only the process of the drives has one. The drives wait for the computer.
"""

import json
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.console.of_process import short_training
from tests.lsl_network import VARIABLE, own_network

import exograv
from exograv.identification.core.prior import prior
from exograv.laboratory.amplifier.amplifier_command import EMG
from exograv.laboratory.amplifier.electrodes import TRIGGER, pulse_times
from exograv.laboratory.participant.touch_screen import SimulatedRoom
from exograv.live.on_drives.acceptance_weighing import ERROR_KG, ERROR_SHARE
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.procedures.rehabilitation.guided.grip import GripOutcome
from exograv.recording import read_recording
from exograv.rig.drives.simulated.address import free_port
from exograv.storage.calibration_file import read_calibration
from exograv.storage.participant_file import read_participant, write_participant
from exograv.storage.participant_schema import StoredParticipant, parameter_rows
from exograv.storage.sealed_file import sealed
from exograv.study.importers.imported_session import StatedSession
from exograv.study.importers.recording import import_recording

pytestmark = pytest.mark.slow

SEED, LEVEL, PERIOD_MS = 1022, 1, 4
"""The longest period is the quickest: these tests are about steps and files, not about timing."""

REPEAT_RMS_DEG = 3.0
"""Largest RMS error of a joint on a repeated path [°], as in lock-step."""

HEAVIER = 1.4
"""Body mass of another person, over that of the form [-]."""

PULSE_S = 0.005
"""Median of the time from the pulse of a touch to the touch as the page states it [s], on a shared computer."""

CHROMIUM = Path("/usr/bin/chromium")
SOURCE = Path(exograv.__file__).parent
EXAMPLE = Path(__file__).parents[3] / "examples" / "drives" / "udp.toml"


@dataclass(frozen=True)
class Machine:
    """Calibrated and tested machine on simulated drives, with its files in a folder."""

    folder: Path

    def exograv(
        self, *words: str, hears: Callable[[str], object] = lambda _link: None
    ) -> "subprocess.CompletedProcess[str]":
        """Run a command to its end; `hears` gets the link of the participant's page."""
        machine = ["--simulate", "--drives", "udp.toml", "--level", str(LEVEL), "--seed", str(SEED)]
        command = [sys.executable, "-m", "exograv.cli", *words, *machine, "--json", "figures.json"]
        said = list[str]()
        with subprocess.Popen(
            command, cwd=self.folder, text=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        ) as process:  # fmt: skip
            assert process.stdout is not None
            for line in process.stdout:
                said.append(line)
                if "participant's screen: http" in line:
                    hears(line.split()[-1])
        return subprocess.CompletedProcess(command, process.returncode, "".join(said), "")

    def flown(
        self,
        *words: str,
        begins: Callable[[], object] = lambda: None,
        hears: Callable[[str], object] = lambda _link: None,
    ) -> dict[str, Any]:
        """Run a command with a fresh pass of the self-test; return its figures."""
        begins()
        shutil.copy(self.folder / "pass.toml", self.folder / "out" / "self_test.toml")
        process = self.exograv(*words, hears=hears)
        assert process.returncode == 0, process.stdout
        return json.loads((self.folder / "figures.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Machine:
    folder = tmp_path_factory.mktemp("machine")
    text = EXAMPLE.read_text(encoding="utf-8")
    for before, after in (
        ("period_ms = 1", f"period_ms = {PERIOD_MS}"),
        ("watchdog_ms = 20.0", "watchdog_ms = 30.0"),
        ("port = 47100", f"port = {free_port()}"),
    ):
        assert before in text
        text = text.replace(before, after, 1)
    (folder / "udp.toml").write_text(text, encoding="utf-8")
    made = Machine(folder)
    for command in (("rig", "calibrate"), ("rig", "self-test")):
        process = made.exograv(*command)
        assert process.returncode == 0, process.stdout
    shutil.copy(folder / "out" / "self_test.toml", folder / "pass.toml")
    return made


def test_an_arm_is_kept_and_only_checked_the_next_time(machine: Machine):
    first = machine.flown("arm", "identify", "--seconds", "25", "--keep", "arm.toml", "--code", "P-08")
    assert (first["from_file"], first["person"]["code"], first["person"]["donnings"]) == (False, "P-08", 1)
    assert first["live"]["identified"]["arm_check"].startswith("The arm may be that of a person of")
    again = machine.flown("arm", "identify", "--participant", "arm.toml", "--keep", "again.toml")
    assert (again["from_file"], again["person"]["code"], again["person"]["donnings"]) == (True, "P-08", 2)
    assert again["live"]["identified"]["motion_s"] < first["live"]["identified"]["motion_s"]


def other_person(whole: StoredParticipant, calibration: Path) -> StoredParticipant:
    """Return the file with the arm of a heavier person of the same form, as stated by the table."""
    person, machine = whole.person, read_calibration(calibration).calibration().machine
    means = [
        np.array([row.mean for row in parameter_rows(assembly, *prior(assembly, machine))])
        for assembly in (
            assemble(load_rig("recupera_like"), Body(person.height_m, mass, person.sex, dict(person.lengths_m)))
            for mass in (person.mass_kg, HEAVIER * person.mass_kg)
        )
    ]
    rows = [
        row.model_copy(update={"mean": row.mean + float(more)})
        for row, more in zip(whole.parameters, means[1] - means[0], strict=True)
    ]
    return sealed(whole.model_copy(update={"parameters": rows}))


def test_a_weight_is_weighed_from_a_stored_arm_and_with_that_of_another_person_no_procedure_begins(machine: Machine):
    file = machine.folder / "out" / "participants" / "P-09.toml"
    machine.flown("arm", "identify", "--seconds", "25", "--keep", str(file), "--code", "P-09")
    words = ("arm", "weigh", "--participant", "P-09", "--hand-weight", "1")
    found = machine.flown(*words)
    assert found["live"]["identified"]["motion_s"] == pytest.approx(FROM_FILE_S, abs=0.3)
    assert (found["live"]["person"]["code"], found["live"]["person"]["donnings"]) == ("P-09", 2)
    (weight,) = found["weights"]
    assert abs(weight["estimated_kg"] - 1.0) <= max(ERROR_SHARE, ERROR_KG)
    path = machine.folder / found["recording"]
    command = [sys.executable, "-m", "exograv.cli", "data", "replay", str(path), "--out", "replay"]
    process = subprocess.run(command, cwd=machine.folder, text=True, capture_output=True, check=False)
    assert "to the last bit" in process.stdout, process.stdout
    write_participant(file, other_person(read_participant(file), machine.folder / "out" / "calibration.toml"))
    before = file.read_bytes()
    shutil.copy(machine.folder / "pass.toml", machine.folder / "out" / "self_test.toml")
    refused = machine.exograv(*words)
    assert refused.returncode == 1
    assert "does not fit this arm: another person's file" in " ".join(refused.stdout.split())
    acts = {one["act"] for one in read_recording(path).messages("/control")}
    assert "publish" in acts
    assert not acts & {"wear", "order"}
    assert file.read_bytes() == before


def test_a_session_runs_from_the_motors_that_switch_on_to_the_arm_that_is_given_back(machine: Machine):
    protocol = short_training(machine.folder)
    session = ("--participant", "P-07", "--protocol", protocol.name)

    def forget() -> None:
        for path in (machine.folder / "out").glob("*.run.json"):
            path.unlink()

    found = machine.flown("run", "train", *session, "--port", "0", begins=forget)
    assert found["is_complete"]
    assert found["windows"] == 2
    assert not found["preparation"]["from_file"]
    process = machine.exograv("next", *session)
    assert "session 2 of 'short.toml' has not begun." in " ".join(process.stdout.split())
    assert (machine.folder / "out" / "participants" / "P-07.toml").is_file()


def test_support_follows_a_weak_person_over_drives_and_the_session_replays_exactly(machine: Machine):
    text = (SOURCE / "task/assist_protocols/assist-as-needed.toml").read_text(encoding="utf-8")
    for before, after in (("blocks = 6", "blocks = 1"), ("block = 12", "block = 4")):
        assert before in text
        text = text.replace(before, after, 1)
    (machine.folder / "assist.toml").write_text(text, encoding="utf-8")
    words = ("run", "assist", "recupera_like", "--participant", "P-11", "--identify", "15")
    found = machine.flown(*words, "--protocol", "assist.toml", "--needed-percent", "80")
    assert (found["session"], found["blocks"]) == (1, 1)
    assert found["is_simulated"]
    assert found["live"]["outcome"].startswith("Stop was pressed.")
    path = machine.folder / found["recording"]
    recording = read_recording(path)
    kinds = [one["kind"] for one in recording.messages("/task")]
    assert kinds == ["reach_began", "reach_ended"] * found["tried"] + ["assist_decided"]
    assert np.nanmax(recording.ticks["gravity_level"]) == pytest.approx(0.15)
    command = [sys.executable, "-m", "exograv.cli", "data", "replay", str(path), "--out", "replay"]
    process = subprocess.run(command, cwd=machine.folder, text=True, capture_output=True, check=False)
    assert "to the last bit" in process.stdout, process.stdout


def test_a_weight_in_the_hand_is_weighed_over_drives_put_down_and_the_run_replays_exactly(machine: Machine):
    found = machine.flown("arm", "weigh", "--identify", "25", "--hand-weight", "1")
    (weight,) = found["weights"]
    assert (weight["place"], weight["stated_kg"]) == ("hand", 1.0)
    assert abs(weight["estimated_kg"] - 1.0) <= max(ERROR_SHARE, ERROR_KG)
    assert found["live"]["outcome"].startswith("Stop was pressed.")
    path = machine.folder / found["recording"]
    recording = read_recording(path)
    orders = [one for one in recording.messages("/control") if one["act"] == "order"]
    carried = [one["mass_kg"] for one in orders if one["mass_kg"] is not None]
    assert carried[1:] == [pytest.approx(weight["estimated_kg"], abs=1e-4), 0.0]
    assert [one for one in recording.messages("/event") if one["kind"] == "warning"] == []
    donning = load_rig("recupera_like").donning_posture
    ends = recording.ticks["q_measured"][recording.ticks["arm_share"] == 1.0][-1]
    assert np.rad2deg(np.abs(ends - donning)).max() < 10.0
    command = [sys.executable, "-m", "exograv.cli", "data", "replay", str(path), "--out", "replay"]
    process = subprocess.run(command, cwd=machine.folder, text=True, capture_output=True, check=False)
    assert "to the last bit" in process.stdout, process.stdout


def test_a_therapist_teaches_a_path_that_is_repeated_over_drives_and_both_runs_replay_exactly(machine: Machine):
    taught = machine.flown("run", "teach", "recupera_like", "--identify", "25", "--code", "K7MR4XX")
    assert taught["is_simulated"]
    assert taught["seconds"] > 5.0
    found = machine.flown(
        "run", "repeat", "recupera_like", "--identify", "25", "--code", "K7MR4XX", "--repetitions", "2"
    )
    assert (found["repetitions"], found["outcome"]) == (2, GripOutcome.ARRIVED.value)
    assert max(found["tracking_rms_deg"]) < REPEAT_RMS_DEG
    for run in (taught, found):
        assert run["live"]["outcome"].startswith("Stop was pressed.")
        path = machine.folder / run["recording"]
        assert [one for one in read_recording(path).messages("/event") if one["kind"] == "warning"] == []
        command = [sys.executable, "-m", "exograv.cli", "data", "replay", str(path), "--out", "replay"]
        process = subprocess.run(command, cwd=machine.folder, text=True, capture_output=True, check=False)
        assert "to the last bit" in process.stdout, process.stdout


@pytest.mark.skipif(not CHROMIUM.exists(), reason=f"There is no {CHROMIUM}. On Debian: apt-get install chromium")
def test_a_virtual_participant_points_at_the_sessions_own_page_and_every_contact_is_recorded(
    machine: Machine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    """Four processes: session with its page, machine with its wearer, stimulus with a browser, and EMG amplifier."""
    protocol = short_training(machine.folder, window_s=22.0)
    session = ("--participant", "P-09", "--protocol", protocol.name)
    stimuli = list[subprocess.Popen[str]]()
    made = machine.folder / "made.json"

    def begins() -> None:
        for path in (machine.folder / "out").glob("*.run.json"):
            path.unlink()

    def play(link: str) -> None:
        command = [
            sys.executable, "-m", "exograv.cli", "dev", "stimulus", link, "--line", str(line), "--json", made.name,
            "--amplifier", str(amplifier_port), "--memory", "skill.json",
        ]  # fmt: skip
        stimuli.append(subprocess.Popen(command, cwd=machine.folder, text=True))

    monkeypatch.setenv(VARIABLE, own_network(tmp_path))
    line, amplifier_port = free_port(), free_port()
    words = ("run", "train", *session, "--port", "0", "--stimulus", str(line), "--record-stream", EMG)
    amplifier = [sys.executable, "-m", "exograv.cli", "dev", "amplifier", "--port", str(amplifier_port)]
    with subprocess.Popen(amplifier) as process:
        found = machine.flown(*words, begins=begins, hears=play)
        process.send_signal(signal.SIGINT)
    assert (machine.folder / "skill.json").is_file()
    assert [stimulus.wait(30.0) for stimulus in stimuli][-1] == 0
    played = json.loads(made.read_text(encoding="utf-8"))
    assert found["is_complete"]
    assert played["is_complete"]
    assert found["touches"] == len(played["made"]) >= 14
    assert Path(found["report"]).name == "P-09_short_01.html"
    imported = import_recording(machine.folder / found["recordings"][-1])
    assert imported.said == StatedSession("P-09", "training", 1)
    assert len(imported.touches) == found["touches"]
    assert imported.session["is_complete"]
    assert imported.session["clock_jumps"] == 0
    recording = read_recording(machine.folder / found["recordings"][-1])
    (emg,) = recording.streams
    pulses = pulse_times(emg.monotonic, emg.values[:, emg.labels.index(TRIGGER)])
    touches = [one["record"]["t"] for one in recording.messages("/task") if one["kind"] == "touch"]
    assert len(pulses) == len(touches)
    assert np.median(np.abs(pulses - touches)) < PULSE_S
    assert imported.session["pitch_x_mm"] == pytest.approx(SimulatedRoom().pitch_mm, rel=0.005)


@pytest.mark.skipif(not CHROMIUM.exists(), reason=f"There is no {CHROMIUM}. On Debian: apt-get install chromium")
def test_a_parabola_on_the_ground_pushes_the_arm_after_the_participant_has_agreed_and_replays_exactly(machine: Machine):
    stimuli, line, made = list[subprocess.Popen[str]](), free_port(), machine.folder / "made.json"

    def begins() -> None:
        for path in (machine.folder / "out").glob("*.run.json"):
            path.unlink()

    def play(link: str) -> None:
        words = ("dev", "stimulus", link, "--line", str(line), "--json", made.name)
        command = [sys.executable, "-m", "exograv.cli", *words]
        stimuli.append(subprocess.Popen(command, cwd=machine.folder, text=True))

    session = ("--participant", "P-10", "--protocol", "parabola", "--windows", "1")
    found = machine.flown("run", "train", *session, "--port", "0", "--stimulus", str(line), begins=begins, hears=play)
    assert [stimulus.wait(30.0) for stimulus in stimuli][-1] == 0
    assert found["is_complete"]
    assert found["touches"] == len(json.loads(made.read_text(encoding="utf-8"))["made"]) > 4
    path = machine.folder / found["recordings"][-1]
    recording = read_recording(path)
    levels = recording.ticks["gravity_level"]
    assert np.nanmax(levels) == 1.8
    pushed_s = PERIOD_MS * 1e-3 * np.count_nonzero(levels > 1.79)
    assert pushed_s > 30.0
    told = [one["text"] for one in recording.messages("/event") if "pushed down" in str(one.get("text", ""))]
    assert told[0] == "The participant agrees for 120 s that the arm is pushed down."
    command = [sys.executable, "-m", "exograv.cli", "data", "replay", str(path), "--out", "replay"]
    process = subprocess.run(command, cwd=machine.folder, text=True, capture_output=True, check=False)
    assert "to the last bit" in process.stdout, process.stdout
