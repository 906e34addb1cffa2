"""The doctor's loop times valid decisions during motion, keeps its contract, and does not change the verdict."""

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from exograv.cli.machine import computer_check as doctor
from exograv.cli.machine.computer_check import Check, ComputerCheck
from exograv.cli.machine.doctor import Doctor, run_doctor
from exograv.cli.shell import terminal
from exograv.cli.shell.base_options import OutFolder
from exograv.errors import ConfigError, ExogravError, RigError
from exograv.procedures.self_test import loop_timing as doctor_loop
from exograv.procedures.self_test.loop_timing import (
    HALVES,
    LatenessHistogram,
    LoopFigures,
    LoopTest,
    measure,
    refuse_unusable,
)
from exograv.procedures.self_test.nominal_tick import MovingTick
from exograv.results import json_value
from exograv.runtime.clock.host import Host
from exograv.runtime.clock.timing import PERIOD_NS, LoopOutcome, Timing

HOST = Host("Linux 6.12", False, True, (), (0, 1), ("performance",), "tsc")
VIRTUAL = Host("Linux 6.12", True, False, (), (0, 1), (), "tsc")
LOOP_STARTS_S = 60.0
"""Longest wait for the loop's process on a busy computer."""


def punctual(work: Callable[[int], object], periods: int) -> Timing:
    """Timing of a loop that takes no time."""
    work(0)
    zeros = np.zeros(periods, dtype=np.int64)
    return Timing(np.arange(periods), zeros, zeros + 40_000, periods, PERIOD_NS, LoopOutcome.COMPLETE)


def figures(host: Host = HOST, periods: int = 30_000) -> LoopFigures:
    """Figures of a loop that takes no time."""
    return measure(lambda _period: None, periods, host, loop=punctual)


def test_the_figures_keep_their_contract_and_hold_nothing_that_json_cannot():
    loop = json.loads(json.dumps(json_value(LoopTest(60.0, figures(), 0)), allow_nan=False))
    assert loop["rate_Hz"] == 1000.0
    assert [row["scheduling"] for row in loop["rows"]] == list(HALVES)
    for row in loop["rows"]:
        assert {"effective_rate_Hz", "longest_gap_us", "late_share", "missed"} <= row.keys()
        assert set(row["lateness_us"]) == set(row["compute_us"]) == {"p50", "p99", "p999", "max"}
        assert len(row["histogram"]["edges_us"]) == len(row["histogram"]["counts"]) + 1
        assert sum(row["histogram"]["counts"]) == row["ticks"]
    assert isinstance(loop["may_drive_worn"], bool)
    assert all(isinstance(text, str) for text in loop["reasons"] + loop["prepare"])


def test_rights_are_taken_for_the_second_half_only_and_given_back():
    seen: list[tuple[int, set[int]]] = []
    before = os.sched_getaffinity(0)
    measure(lambda _period: seen.append((os.sched_getscheduler(0), os.sched_getaffinity(0))), 10, HOST, loop=punctual)
    assert seen[0] == (os.sched_getscheduler(0), before)
    assert seen[1] != seen[0] or len(before) == 1
    assert (os.sched_getscheduler(0), os.sched_getaffinity(0)) == seen[0]


def test_a_virtual_machine_may_not_however_punctual_it_is():
    loop = figures(VIRTUAL)
    assert not loop.may_drive_worn
    assert any("its host can stop it" in reason for reason in loop.reasons)


def test_a_short_run_names_the_length_that_shows_the_goal():
    assert "--loop 600" in figures(periods=30_000).prepare[-1]
    assert not any("--loop" in step for step in figures(periods=300_000).prepare)


@pytest.mark.parametrize("seconds", [0.0, -5.0, 1.9, 1e5, float("nan"), float("inf")])
def test_a_time_that_cannot_be_run_is_refused_before_anything_is_built(seconds: float):
    with pytest.raises(ConfigError, match=r"--loop is .*; allowed: 2 to 7200 s"):
        refuse_unusable(seconds)


@pytest.mark.parametrize(
    ("exit_status", "words"), [(-signal.SIGXCPU, "a tick did not return"), (1, r"died \(exit status 1\)")]
)
def test_a_loop_that_dies_is_told_in_a_sentence(exit_status: int, words: str):
    with pytest.raises(RigError, match=words):
        raise RigError(doctor_loop._obituary(exit_status))


@pytest.fixture(scope="module")
def tick() -> MovingTick:
    return MovingTick(1e-3)


def test_the_timed_tick_moves_the_loops_and_keeps_them_closed(tick: MovingTick):
    postures = []
    for period in range(3000):
        tick(period)
        postures.append(tick.tick.z.copy())
    assert tick.open_ticks == 0
    assert np.ptp(postures, axis=0).max() > 0.1  # [rad] The closure gives the arm's own joints.
    assert np.abs(np.diff(postures, axis=0)).max() < 0.01  # [rad] The posture has no jump.


def test_the_motion_runs_on_after_its_end(tick: MovingTick):
    length = len(tick._references)
    last, first = tick._references[-1], tick._references[0]
    np.testing.assert_allclose(first.q - last.q, 1e-3 * first.v, atol=1e-5)
    tick(length - 100)
    before = tick.open_ticks  # A jump from another posture may open the loops for a tick.
    for period in range(length - 99, length + 100):
        tick(period)
    assert tick.open_ticks == before


@pytest.mark.parametrize("columns", [40, 80, 200])
def test_the_result_fits_the_terminal(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.setenv("COLUMNS", str(columns))
    terminal.show_loop(figures(VIRTUAL))
    shown = capsys.readouterr().out
    assert max(len(line.rstrip()) for line in shown.splitlines()) <= columns
    words = " ".join(shown.split())
    assert "must not drive a worn machine" in words
    assert "missed periods" in words
    assert "30000" in words


def test_one_late_tick_among_many_shows_in_the_histogram():
    counts = [30_000, *[0] * 11, 1]
    edges = list(range(len(counts) + 1))
    histogram = LatenessHistogram(tuple(edges), counts)
    lines = terminal.histogram_lines(histogram, histogram, width=80)
    assert lines[-1].count("█") >= 2


@pytest.fixture
def whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Computer that meets all requirements."""
    result = ComputerCheck(True, "Linux", [Check("out", True, "")], None, {})
    monkeypatch.setattr(doctor, "examine_computer", lambda _folder: result)


@pytest.mark.usefixtures("whole")
def test_a_computer_unfit_for_worn_machines_is_no_broken_installation(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(doctor_loop, "loop_test", lambda _seconds, _progress: LoopTest(60.0, figures(VIRTUAL), 0))
    result = json_value(run_doctor(Doctor(loop=60.0), OutFolder()))
    assert not result["loop"]["may_drive_worn"]
    assert result["ok"]


def test_where_something_is_missing_the_loop_is_not_run(monkeypatch: pytest.MonkeyPatch):
    lacking = ComputerCheck(False, "Linux", [Check("out", False, "")], None, {})
    monkeypatch.setattr(doctor, "examine_computer", lambda _folder: lacking)
    monkeypatch.delattr(doctor_loop, "loop_test")
    monkeypatch.setattr(doctor_loop, "loop_test", None, raising=False)
    assert "loop" not in json_value(run_doctor(Doctor(loop=60.0), OutFolder()))


def run(*words: str, folder: Path) -> list[str]:
    """Process of the command line that runs the doctor's loop."""
    return [sys.executable, "-m", "exograv.cli", "doctor", "--out", str(folder), *words]


@pytest.mark.slow
def test_the_loop_runs_in_a_process_of_its_own_and_both_halves_come_back(tmp_path: Path):
    path = tmp_path / "doctor.json"
    result = subprocess.run(
        run("--loop", "2", "--json", str(path), folder=tmp_path), capture_output=True, text=True, check=False
    )
    assert "Traceback" not in result.stderr
    loop = json.loads(path.read_text())["loop"]
    assert [row["seconds"] for row in loop["rows"]] == pytest.approx([1.0, 1.0], abs=0.5)
    assert all(row["ticks"] > 0 for row in loop["rows"])
    assert not loop["may_drive_worn"]  # One second is too short for a verdict.


@pytest.mark.slow
def test_the_keyboard_stops_it_without_a_traceback_and_leaves_no_process(tmp_path: Path):
    process = subprocess.Popen(
        run("--loop", "600", folder=tmp_path), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    loop = wait_for_child(process.pid)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=LOOP_STARTS_S)
    assert process.returncode == 130
    assert "Traceback" not in errors
    assert not Path(f"/proc/{loop}").exists()


def wait_for_child(parent: int) -> int:
    """Wait for the process that runs the loop, and return its identifier."""
    for _ in range(int(LOOP_STARTS_S / 0.1)):
        for task in Path("/proc").glob("[0-9]*"):
            words = _read(task / "cmdline")
            if "spawn_main" in words and f"PPid:\t{parent}\n" in _read(task / "status"):
                return int(task.name)
        signal.sigtimedwait([], 0.1)
    raise ExogravError("The loop's process has not started.")


def _read(path: Path) -> str:
    try:
        return path.read_text()
    except OSError:
        return ""
