"""The command line answers fast, refuses in one readable line, and keeps its contract with scripts."""

import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest
from tests import preloaded
from tests.waiting import wait_until

from exograv import __version__
from exograv.campaigns.faults.evaluation import figures_of
from exograv.campaigns.faults.figures import FaultFigures, HandCount, HandFigures, MissFigures, ReactionTimes
from exograv.cli import FORMER_NAMES, GROUPS, START, resolved, was_keyboard
from exograv.cli.shell.terminal import show_demo
from exograv.cli.simulation.faults import show_faults
from exograv.identification.core.interface import Outcome
from exograv.laboratory.demo_result import (
    ControllerLeftOver,
    DemoFindings,
    DemoResult,
    FloatedArm,
    FloatFigures,
    HandWeight,
    IdentificationFigures,
    IdentifiedArm,
    LeftOverTable,
    MeasuredCalibration,
    ModelNotes,
    ParticipantFigures,
    PayloadLeftOver,
    PossibleLeftOver,
)
from exograv.laboratory.reference_wearers import WearerComparison
from exograv.laboratory.result_rows import BaseParameterRow, IdentifiabilityResult, WeightRow
from exograv.procedures.identification.carried_figures import CarriedFigures
from exograv.recording import read_recording

URDF = Path(__file__).parents[1] / "robots" / "recupera_like" / "right.urdf"
LOG = ("identify-log", "none.csv", "--unloaded", "none.csv", "--urdf", str(URDF), "--payload-frame", "hand_mount")
RECORDING_STARTS_S = 60.0
"""Longest wait for the first bytes of a recording, on a busy machine."""


def exograv(*words: str, folder: Path, columns: int = 80) -> subprocess.CompletedProcess[str]:
    """Run one command in its own process."""
    return preloaded.exograv(*words, folder=folder, environment={**os.environ, "COLUMNS": str(columns)})


REFUSED = {
    "an unknown machine": (("demo", "--rig", "nobody"), "No machine 'nobody'. Known: agree_like, nesm_like, recup"),
    "a level that does not exist": (("demo", "--level", "7"), "--level is 7; allowed: 0"),
    "more than the weight of the arm": (("demo", "--gravity-level", "2"), "--gravity-level is 2.0; allowed: 0"),
    "a gravity level that is no number": (("demo", "--gravity-level", "nan"), "--gravity-level is nan"),
    "a calibration at a level that does not exist": (("calibrate", "--level", "7"), "--level is 7; allowed: 0"),
    "a re-check of nothing": (("calibrate", "--recheck", "--calibration", "none.toml"), "none.toml cannot be read"),
    "a calibration of another kind": (("identify", "--calibration", "file"), "has no schema_version"),
    "a calibration without motors": (("calibrate", "--rig", "recupera_like_passive"), "has no motor"),
    "a participant who has no file": (("identify", "--participant", "none.toml"), "none.toml cannot be read"),
    "a participant's file of another kind": (("identify", "--participant", "file"), "has no schema_version"),
    "a name for a code": (("identify", "--keep", "p.toml", "--code", "anna"), "--code is 'anna'; it must have 3 to 16"),
    "a file for a participant under a file": (("identify", "--keep", "file/p.toml"), "Give another path with --keep"),
    "a donning before the first": (("identify", "--donning", "-1"), "--donning is -1; allowed: 0"),
    "a calibration over another file": (("calibrate", "--calibration", "rig.toml"), "rig.toml is of another kind"),
    "a participant over another file": (("identify", "--keep", "rig.toml"), "rig.toml is of another kind"),
    "a folder for a verification in memory": (("verify", "--out", "elsewhere"), "acts only on drives"),
    "two first seeds": (
        ("benchmark-identification", "--seed", "7", "--seed-from", "8"),
        "--seed is 7, but it acts only",
    ),
    "an export without a file": (
        ("export-urdf", "--participant", "none.toml"),
        "none.toml cannot be read",
    ),
    "too short a motion": (("identify", "--seconds", "1"), "--seconds is 1.0; allowed: 5 to 600"),
    "a negative seed": (("demo", "--seed", "-1"), "--seed is -1"),
    "a folder that is a file": (
        ("demo", "--out", "file"),
        "Give another folder with --out|give another folder with --out",
    ),
    "figures into a folder": (("demo", "--json", "."), "Give another path with --json"),
    "figures over another file": (("rigs", "--json", "rig.toml"), "rig.toml holds something else than figures"),
    "figures under a file": (("rigs", "--json", "file/x.json"), "Give another path with --json"),
    "benchmark of no method": (
        ("benchmark-identification", "--methods", "magic"),
        "--methods has 'magic'; known: recursive",
    ),
    "a benchmark of no wearer": (
        ("benchmark-identification", "--wearers", "0", "--streams", "0"),
        "nothing would run",
    ),
    "transparency of no machine": (("transparency", "--machines", "0"), "--machines is 0; allowed: 1 to 100"),
    "transparency without motors": (("transparency", "--rig", "recupera_like_passive"), "nothing can be compensated"),
    "transparency of two arms": (("transparency", "--rig", "recupera_like_dual"), "effort is measured on one"),
    "a session without a participant": (("train",), "--participant is missing; it must have 3 to 16"),
    "a machine option without a machine": (("demo", "--rig"), "--rig has no value; give the name of a machine"),
    "the disturbances of a real machine": (("calibrate", "--drives", "d.toml", "--level", "3"), "acts only on a simul"),
    "a virtual person beside a recorded one": (
        ("support-level", "--recording", "r.mcap", "--level", "3"),
        "--level is 3, but it acts only for a virtual person",
    ),
    "a lossy network for a listener": (("aircraft", "--loss", "0.5"), "--loss is 0.5, but it acts only in `exograv da"),
    "a group of no new person": (("study", "participant", ".", "list", "--group", "A"), "with the action `new`"),
    "faults of a motor that is not simulated": (
        ("rig-test", "--drives", "d.toml", "--by", "ab", "--wrong-sign", "elbow_flexion"),
        "acts only with --simulate",
    ),
    "a fitted twin of a machine without drives": (("calibrate", "--twin", "fitted"), "acts only with --simulate"),
    "a session to go on with that never began": (
        ("train", "--participant", "P-01", "--resume"),
        "There is no run to go on with",
    ),
    "a training without motors": (
        ("train", "--participant", "P-01", "--rig", "recupera_like_passive"),
        "needs an active machine",
    ),
    "a session for two arms": (
        ("train", "--participant", "P-01", "--rig", "recupera_like_dual"),
        "is for both arms",
    ),
    "a protocol that is none": (
        ("train", "--participant", "P-01", "--protocol", "file"),
        "file: ",
    ),
    "a missing recording": (("report", "none.mcap"), "No recording 'none.mcap'"),
    "a file that is no recording": (("report", "file"), "is not an MCAP file"),
    "gains that are no numbers": ((*LOG, "--gains", "1,x"), "--gains is '1,x'; give numbers separated by commas"),
    "too few gains": ((*LOG, "--gains", "1,2"), "--gains has 2 numbers; recupera_like_right has 4 joints"),
    "a gain of nothing": ((*LOG, "--gains", "1,2,0,4"), "--gains of joint 'shoulder_rotation' is 0.0"),
    "a machine's URDF that is missing": (("new-rig", "none.urdf"), "none.urdf cannot be read"),
    "a new machine over an old one": (("new-rig", str(URDF), "--out", "file"), "file exists already; nothing is over"),
    "a check of an unknown machine": (("check-rig", "nobody"), "No machine 'nobody'"),
    "a giant in a machine": (("check-rig", "recupera_like", "--height-m", "175"), "height is 175.0 m; allowed: 1.2 to"),
    "a sender that is no IPv4 address": (
        ("aircraft", "listen", "--sender", "cabin"),
        "--sender is 'cabin'; give the IPv4",
    ),
    "a recorded flight without its file": (
        ("aircraft", "replay"),
        "Give the file of the recorded acceleration with --f",
    ),
    "a recorded flight in other words": (
        ("aircraft", "replay", "--file", "file"),
        "do not hold names of three accelera",
    ),
    "a recorded flight for a listener": (("aircraft", "--unit", "g"), "it acts only in `exograv data aircraft replay`"),
    "a relay of no stream": (("aircraft", "relay"), "Name the stream of the acceleration with --stream"),
    "a relay of four axes": (
        ("aircraft", "relay", "--stream", "IMU", "--columns", "t", "x", "y", "z"),
        "--columns names 4 channels; a stream needs three: X Y Z",
    ),
    "an aircraft on no port": (("aircraft", "listen", "--port", "99999"), "--port is 99999; allowed: 1 to 65535"),
    "a table of payloads": (
        (*LOG, "--gains", "1,2,3,4", "--method", "anthropometric"),
        "is for arms: a payload has no table",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_done_is_refused_in_one_line(case: str, tmp_path: Path):
    (tmp_path / "file").touch()
    (tmp_path / "rig.toml").write_text('name = "my_machine"\n', encoding="utf-8")
    words, message = REFUSED[case]
    result = exograv(*words, folder=tmp_path)
    assert result.returncode == 1
    assert result.stderr.startswith("exograv: ")
    assert result.stderr.count("\n") == 1
    assert any(part in result.stderr for part in message.split("|"))


@pytest.mark.parametrize("words", [("nothing",), ("demo", "--level", "x"), ("report",), ("demo", "--method", "least")])
def test_words_that_mean_nothing_are_answered_with_the_way_to_help(words: tuple[str, ...], tmp_path: Path):
    result = exograv(*words, folder=tmp_path)
    assert result.returncode == 2
    assert "--help" in result.stderr
    assert "Traceback" not in result.stderr


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (("calibrat",), "exograv rig calibrate"),
        (("rig", "chek"), "exograv rig check"),
        (("dem",), "exograv demo"),
        (("bench",), "exograv dev benchmark-identification?"),
        (("dev", "bench"), "exograv dev benchmark-identification?"),
    ],
)
def test_a_mistyped_command_is_answered_with_the_one_that_was_meant(words: tuple[str, ...], meant: str, tmp_path: Path):
    result = exograv(*words, folder=tmp_path)
    assert result.returncode == 2
    assert f"Did you mean: {meant}" in result.stderr


def test_without_a_command_the_first_steps_and_all_groups_are_shown(tmp_path: Path):
    result = exograv(folder=tmp_path)
    assert result.returncode == 0
    assert "exograv demo" in result.stdout
    assert all(f"\n  {word} " in result.stdout for word in GROUPS)


@pytest.mark.parametrize(("words", "option"), [(["help"], ["--help"]), (["rig", "help"], ["rig", "--help"])])
def test_the_word_help_is_understood_as_the_option(words: list[str], option: list[str]):
    assert resolved(words)[0] == resolved(option)[0]


@pytest.mark.parametrize("former", [*FORMER_NAMES, "calibrate", "identify", "replay", "faults"])
def test_a_former_name_leads_to_the_same_command(former: str, tmp_path: Path):
    path, _ = resolved([former])
    assert exograv(former, "--help", folder=tmp_path).stdout == exograv(*path.split(), "--help", folder=tmp_path).stdout


def test_every_command_has_a_name_of_its_own_outside_of_its_group():
    names = [name for word, group in GROUPS.items() if word != "study" for name in group.commands]
    assert len(names) == len(set(names))
    assert not set(names) & {*START, *GROUPS}


def test_a_reader_that_closes_the_pipe_causes_no_message(tmp_path: Path):
    command = f"{sys.executable} -m exograv.cli rigs --help | head -1"
    result = subprocess.run(command, shell=True, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.stderr == ""


def test_the_package_runs_as_a_module(tmp_path: Path):
    command = [sys.executable, "-m", "exograv", "--version"]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    assert result.stdout == f"exograv {__version__}\n"


def test_it_says_which_version_it_is(tmp_path: Path):
    assert exograv("--version", folder=tmp_path).stdout == f"exograv {__version__}\n"


def test_a_missing_log_is_named(tmp_path: Path):
    frame = (*LOG[:-1], "upper_arm_cuff")
    result = exograv(*frame, "--gains", "1,2,3,4", folder=tmp_path)
    assert result.returncode == 1
    assert "none.csv cannot be read" in result.stderr


def test_a_refused_command_leaves_no_empty_file_of_figures(tmp_path: Path):
    exograv("demo", "--level", "7", "--json", "figures.json", folder=tmp_path)
    assert not (tmp_path / "figures.json").exists()


def test_a_refused_command_does_not_touch_figures_of_an_earlier_one(tmp_path: Path):
    (tmp_path / "figures.json").write_text("{}")
    exograv("demo", "--level", "7", "--json", "figures.json", folder=tmp_path)
    assert (tmp_path / "figures.json").read_text() == "{}"


def test_help_waits_for_no_engine():
    program = (
        "import sys\nfrom exograv import cli\nsys.argv = ['exograv', '--help']\n"
        "try:\n    cli.main()\nexcept SystemExit:\n    pass\n"
        "print(*({'casadi', 'mujoco', 'scipy', 'matplotlib', 'numpy', 'llvmlite'} & set(sys.modules)), file=sys.stderr)"
    )
    result = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert result.stderr.split() == []
    for command in ("demo", "identify", "calibrate", "transparency", "identify-log", "report", "rigs", "doctor"):
        assert command in result.stdout


@pytest.mark.parametrize(("chosen", "used"), [(None, "1"), ("2", "2")])
def test_a_command_keeps_linear_algebra_to_one_thread_unless_told_otherwise(chosen: str | None, used: str):
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    environment |= {} if chosen is None else {"OPENBLAS_NUM_THREADS": chosen}
    program = (
        "import os, sys\nfrom exograv import cli\nassert 'numpy' not in sys.modules\n"
        "sys.argv = ['exograv', 'rigs']\ncli.main()\nprint(os.environ['OPENBLAS_NUM_THREADS'])"
    )
    command = [sys.executable, "-c", program]
    result = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    assert result.stdout.split()[-1] == used


@pytest.mark.parametrize(("cause", "was"), [(KeyboardInterrupt(), True), (OSError("no such library"), False)])
def test_ctrl_c_is_recognised_where_a_compiled_module_made_an_import_error_of_it(cause: BaseException, was: bool):
    middle, error = ImportError("initialization failed"), ImportError("mujoco")
    middle.__cause__, error.__cause__ = cause, middle
    assert was_keyboard(error) is was


@pytest.mark.parametrize("columns", [20, 40, 200])
def test_help_and_lists_fit_any_terminal(columns: int, tmp_path: Path):
    assert exograv("--help", folder=tmp_path, columns=columns).returncode == 0
    assert "recupera_like" in exograv("rigs", folder=tmp_path, columns=columns).stdout


def test_the_machines_are_listed_for_scripts_too(tmp_path: Path):
    assert exograv("rigs", "--json", "new/rigs.json", folder=tmp_path).returncode == 0
    rigs = {rig["name"]: rig for rig in json.loads((tmp_path / "new" / "rigs.json").read_text())["rigs"]}
    assert {name: (len(rig["joints"]), rig["sides"]) for name, rig in rigs.items()} == {
        "agree_like": (4, ["right"]),
        "nesm_like": (4, ["right"]),
        "recupera_like": (4, ["right", "left"]),
        "recupera_like_7": (7, ["right", "left"]),
        "recupera_like_dual": (8, ["both"]),
        "recupera_like_passive": (4, ["right", "left"]),
        "recupera_like_qdd": (4, ["right", "left"]),
    }


def test_a_new_machine_has_problems_until_it_is_answered_and_the_exit_status_says_so(tmp_path: Path):
    made = exograv("new-rig", str(URDF), folder=tmp_path)
    assert made.returncode == 0
    assert "drives.gear_ratio: turns of the motor per turn of the joint" in made.stdout
    words = ("check-rig", "recupera_like_right", "--json", "check.json", "--out", "out")
    assert exograv(*words, folder=tmp_path).returncode == 1
    result = json.loads((tmp_path / "check.json").read_text(encoding="utf-8"))
    assert {"rank", "human_dof", "unsupported", "problems", "largest_arm_kg"} <= result.keys()
    assert result["problems"]


def test_a_machine_without_problems_passes_its_check(tmp_path: Path):
    words = ("check-rig", "recupera_like", "--json", "check.json", "--out", "out")
    checked = exograv(*words, folder=tmp_path)
    assert checked.returncode == 0
    assert "cuffs support 4 of 4 freedoms" in checked.stdout
    result = json.loads((tmp_path / "check.json").read_text(encoding="utf-8"))
    assert (result["rank"], result["human_dof"], result["problems"]) == (4, 4, [])


def test_the_doctor_says_what_is_wrong_and_so_does_its_exit_status(tmp_path: Path):
    (tmp_path / "file").touch()
    result = exograv("doctor", "--out", "file", "--json", "doctor.json", folder=tmp_path)
    assert result.returncode == 1
    assert "give another folder with --out" in result.stdout
    checks = {check["name"]: check["ok"] for check in json.loads((tmp_path / "doctor.json").read_text())["checks"]}
    assert not checks.pop("out")
    assert all(checks.values())


def test_a_run_that_is_stopped_by_the_keyboard_leaves_a_recording_that_can_be_read(tmp_path: Path):
    # A shell without job control starts background processes that ignore Ctrl-C, and their children ignore it too.
    listening = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)"
    command = [
        sys.executable,
        "-c",
        f"{listening}; from exograv.cli import main; main()",
        "demo",
        "--out",
        str(tmp_path),
    ]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    path = tmp_path / "demo_calibration.mcap"
    wait_until(lambda: path.exists() and path.stat().st_size > 500_000, "half a megabyte", RECORDING_STARTS_S)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=RECORDING_STARTS_S)
    assert process.returncode == 130
    assert "stopped by the keyboard. The recording until now is kept: " in errors
    assert "Traceback" not in errors
    recording = read_recording(path)
    assert recording.remark is None
    assert len(recording.ticks) > 1000
    again = exograv("report", str(path), "--out", "again", folder=tmp_path)
    assert again.returncode == 0
    assert (tmp_path / "again" / "report.html").stat().st_size > 10_000


@pytest.mark.parametrize("columns", ["40", "80", "200"])
def test_a_campaign_cuts_no_figure_off_and_breaks_no_line_that_is_to_be_copied(
    columns: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setenv("COLUMNS", columns)
    line = "exograv dev faults --seed 1000 --level 3 --persons 4 --replay '145:F03 spike+F06 twice'"
    row = FaultFigures(
        "an encoder",
        "interface",
        31,
        30,
        28,
        ReactionTimes(14.5, 50.0, 56.25),
        112.0,
        7,
        "",
        "",
        0.321,
        None,
        0.0,
        0.0,
        known=3,
        misses={"time_ms": MissFigures(112.0, 7, None, 4, "A known cause.")},
        hands_stopped=HandCount(12, 0, 0.321),
        hands=HandCount(25, 1, 1.27),
    )
    hand = HandFigures(400, 1.27, 1, 1.0, [f"{line}: 1.27 m/s"])
    result = replace(figures_of([], {}, seed=1000), by_fault={"F03 spike": row}, relaxed_hand_every_flight_m_s=hand)
    show_faults(replace(result, scenarios=1000, ticks=1830000, missed=[line], replay=[line]))
    shown = capsys.readouterr().out
    assert "…" not in shown
    assert all(cell in shown for cell in ("14.5", "56.25", "112", "0.321", "1.27"))
    assert shown.count(line) == 3
    sentence = (
        "F03 spike misses time_ms of 112 in 7 of 30, not found in time. A known cause. 4 exceed what this explains."
    )
    assert sentence in " ".join(shown.split())


def test_the_closing_table_fits_a_small_terminal(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]):
    monkeypatch.setenv("COLUMNS", "40")
    four = [1.0, 2.0, 3.0, 4.0]
    base = BaseParameterRow({"forearm.mz": 1.0}, "kg·m", 0.1, [0.0, 0.2])
    score = ControllerLeftOver(four, four, four)
    joints = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
    carried = CarriedFigures(True, four, four, four, four, four)
    arm = IdentifiedArm(
        LeftOverTable(score, score),
        IdentificationFigures(None, 5.0, None, "The motion ran its full time.", Outcome.CONVERGED, "", 12.0, carried),
        IdentifiabilityResult(51, None, [base, base], ("forearm.mz",), (), []),
        PossibleLeftOver(four, four),
        [],
    )
    findings = DemoFindings(
        "recupera_like",
        "recursive",
        "designed",
        2,
        "home",
        0,
        joints,
        MeasuredCalibration(),
        [],
        WearerComparison("This run against 30 other simulated wearers."),
        arm,
        FloatedArm(
            FloatFigures(0.0, [0.0, 0.0, 0.0, 0.0], 10.0),
            HandWeight(WeightRow(0.8, 0.81, [0.7, 0.9]), PayloadLeftOver(four, four)),
        ),
    )
    nobody, ticks, report = ParticipantFigures(None, None), {"p50": 60.0, "p99": 100.0}, Path("out/report.html")
    notes = ModelNotes("[bold]arm26", ("All forces of the model are left out: 6 [/muscles].",))
    result = DemoResult(findings, nobody, 0, notes, ticks, 40.0, 30.0, report, Path("out/demo.mcap"))
    show_demo(result)
    shown = capsys.readouterr().out
    assert max(len(line) for line in shown.splitlines()) <= 40
    assert "out/report.html" in shown
    assert "misses its target at shoulder flexion by 0.80 N·m, at shoulder abduction by" in " ".join(shown.split())
    assert "This run against 30 other simulated wearers." in " ".join(shown.split())
    assert "holds a still arm, so a small drift says little; the left over says more" in " ".join(shown.split())
    assert "at most 1.00, 2.00, 3.00, 4.00 N·m" in " ".join(shown.split())
    assert "determined 1 of 51 parameters, in 2 combinations" in " ".join(shown.split())
    assert "The person did not relax from 12 s on." in " ".join(shown.split())
    assert "Arm model: [bold]arm26. All forces of the model are left out: 6 [/muscles]." in " ".join(shown.split())
