"""An engine that crashes, hangs up or fails is reported; the run goes on without it."""

import json
import sys
from typing import Any

import pytest

from peers import section_supervisor
from peers.section_supervisor import Findings, run_section

SCRIPT = """
import json, os, signal, sys
order = json.loads(sys.argv[1])
without = {{(row, who) for row, who, _ in order["without"]}}
def say(**words): print(json.dumps(words), flush=True)
for row in ("first", "second", "third"):
    if row in order["done"]:
        continue
    for who in ("good", "bad"):
        say(at=[row, who])
        if (row, who) in without or ("*", who) in without:
            say(missing={{"implementation": who, "row": row, "reason": "crashed"}})
        elif who == "bad" and row != "first":
            {disaster}
    say(at=[row, None])
    say(row={{"name": row, "implementation": "good"}})
    say(done=row)
"""


@pytest.fixture
def run_script(monkeypatch, tmp_path):
    def run(disaster: str) -> Findings:
        script = tmp_path / "script.py"
        script.write_text(SCRIPT.format(disaster=disaster))
        real = section_supervisor.subprocess.Popen

        def replaced(command: list[str], **options: Any):
            return real([sys.executable, str(script), command[-1]], **options)

        monkeypatch.setattr(section_supervisor.subprocess, "Popen", replaced)
        findings = Findings()
        run_section({"section": "single", "quick": True}, findings, lambda _text, _share: None)
        return findings

    return run


@pytest.mark.parametrize(
    "disaster", ["os.kill(os.getpid(), signal.SIGSEGV)", "sys.exit(3)", "raise RuntimeError('no')"]
)
def test_a_crash_costs_the_one_who_crashed_and_no_row(run_script, disaster: str):
    findings = run_script(disaster)
    assert [row["name"] for row in findings.rows] == ["first", "second", "third"]
    assert {(entry["implementation"], entry["row"]) for entry in findings.missing} == {
        ("bad", "second"),
        ("bad", "third"),
    }


def test_a_process_that_is_silent_for_too_long_is_ended(run_script, monkeypatch):
    monkeypatch.setattr(section_supervisor, "STALLED_S", 0.5)
    findings = run_script("import time; time.sleep(60)")
    assert [row["name"] for row in findings.rows] == ["first", "second", "third"]


def test_a_process_that_dies_before_it_began_is_reported_once(monkeypatch):
    real = section_supervisor.subprocess.Popen
    monkeypatch.setattr(
        section_supervisor.subprocess,
        "Popen",
        lambda command, **options: real([sys.executable, "-c", "raise SystemExit(2)"], **options),
    )
    findings = Findings()
    run_section({"section": "own", "quick": True}, findings, lambda _text, _share: None)
    assert [(entry["implementation"], entry["row"]) for entry in findings.missing] == [("all", "own")]


@pytest.mark.parametrize("who", ["bad", None])
def test_a_section_that_dies_of_the_same_again_and_again_ends(monkeypatch, who: str | None):
    words = json.dumps({"at": ["limits", who]})
    real, started = section_supervisor.subprocess.Popen, []

    def replaced(_command: list[str], **options: Any):
        started.append(1)
        return real([sys.executable, "-c", f"print({words!r}); raise SystemExit(2)"], **options)

    monkeypatch.setattr(section_supervisor.subprocess, "Popen", replaced)
    findings = Findings()
    run_section({"section": "own", "quick": True}, findings, lambda _text, _share: None)
    assert len(started) <= section_supervisor.CRASHES_MAX + 1
    assert findings.missing
