"""A bring-up that Ctrl-C, SIGTERM or SIGHUP interrupts leaves a sealed sheet that names the step; no step failed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.terminal import ctrl_c_after, in_terminal

from exograv.storage.bring_up_sheet import FILE, BringUpSheet
from exograv.storage.sealed_file import read_sealed

STEP_S = 240.0
"""Time limit for the steps before the nudges, on a computer with much other work [s]."""

BRING_UP = """\
import signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell in the background lets its children ignore it
signal.signal(signal.SIGHUP, signal.SIG_DFL)  # as does nohup
from exograv.cli import main
sys.argv = ["exograv", "rig", "test", "recupera_like", "--simulate", "--by", "ab", "--out", sys.argv[1]]
main()
"""


@pytest.mark.skipif(os.name != "posix", reason="a terminal's Ctrl-C reaches all processes of a group only on POSIX")
@pytest.mark.parametrize(
    "name", [pytest.param("SIGTERM", marks=pytest.mark.long), pytest.param("SIGHUP", marks=pytest.mark.long)]
)
def test_an_interrupted_bring_up_leaves_a_sealed_sheet_with_its_step(name: str, tmp_path: Path):
    strike = signal.Signals[name]
    words = [sys.executable, "-c", BRING_UP, str(tmp_path)]
    pipe = subprocess.PIPE
    said = ""
    with subprocess.Popen(words, stdout=pipe, stderr=subprocess.STDOUT, text=True, start_new_session=True) as process:
        assert process.stdout is not None
        for line in process.stdout:
            said += line
            if "Pushing" in line and said.count("Pushing") == 1:
                os.killpg(process.pid, strike)  # as a terminal or a service does
    assert process.returncode == 128 + strike, said
    assert "was interrupted at the step “nudges”" in " ".join(said.split())
    assert "Traceback" not in said
    expect_aborted(tmp_path)


def expect_aborted(folder: Path) -> None:
    """Expect a sealed sheet of a bring-up that was interrupted in the step of nudges, and no failed step."""
    sheet = read_sealed(folder / FILE, BringUpSheet, "", "")
    assert sheet.done.interrupted_at == "nudges"
    assert not sheet.done.passed
    assert sheet.steps
    assert all(step.passed for step in sheet.steps)


@pytest.mark.skipif(os.name != "posix", reason="Windows has no such terminals")
def test_the_key_ctrl_c_in_a_terminal_leaves_a_sealed_sheet_that_says_aborted(tmp_path: Path):
    words = ["rig", "test", "recupera_like", "--simulate", "--by", "ab", "--out", str(tmp_path)]
    with in_terminal(words, tmp_path) as run:
        status = ctrl_c_after(run, "Pushing", STEP_S)
    assert status == 128 + signal.SIGINT, run.text
    assert "was interrupted at the step “nudges”" in run.text
    assert "Traceback" not in run.text
    expect_aborted(tmp_path)
