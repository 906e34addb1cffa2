"""`exograv study simulate` on the command line: a short study with JSON, recordings, report and continuation."""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from tests.preloaded import exograv
from tests.waiting import wait_until

SHORT = ("--participants", "1,1", "--sessions", "1,1", "--windows", "1", "--flight-windows", "1", "--seed", "1005")


def command(*words: str) -> list[str]:
    return [sys.executable, "-m", "exograv.cli", "simulate-study", *words]


def study(folder: Path, *words: str) -> dict:
    told = folder.with_suffix(".json")
    exograv("simulate-study", *SHORT, "--out", str(folder), "--json", str(told), *words, check=True)
    return json.loads(told.read_text(encoding="utf-8"))


def without_time(result: dict) -> dict:
    """Result without paths and times, which differ between two runs."""
    return {name: value for name, value in result.items() if name in ("groups", "direction", "conditions", "transfer")}


@pytest.mark.long
def test_a_short_study_follows_the_contract_and_says_that_it_is_simulated(tmp_path):
    result = study(tmp_path / "one", "--conditions", "ideal", "--processes", "1")
    assert {"groups", "conditions", "transfer", "dataset", "report"} <= set(result)
    for group in ("trained", "untrained"):
        assert {"median_px", "iqr_px"} <= set(result["groups"][group])
        assert result["groups"][group]["median_px"] > 0.0
    assert {"median_px", "left_over_Nm", "transfer"} <= set(result["conditions"]["ideal"])
    assert result["conditions"]["ideal"]["left_over_Nm"] > 0.0
    assert "SIMULATED" in Path(result["report"]).read_text(encoding="utf-8").upper()
    sessions = list((Path(result["dataset"]) / "sourcedata").glob("*/*"))
    assert sorted(path.name.rsplit("-", 1)[0] for path in sessions) == [
        "familiarisation-first-1", "flight-first-1", "flight-first-1", "training-first-1",
    ]  # fmt: skip


@pytest.mark.slow
def test_figures_do_not_depend_on_the_number_of_processes_nor_on_an_interruption(tmp_path):
    first = study(tmp_path / "one", "--conditions", "ideal,water", "--processes", "1")
    second = study(tmp_path / "two", "--conditions", "ideal,water", "--processes", "2")
    assert without_time(second) == without_time(first)

    folder = tmp_path / "broken"
    words = [*SHORT, "--conditions", "ideal,water", "--processes", "2", "--out", str(folder)]
    with subprocess.Popen(command(*words), stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL) as run:
        wait_until(lambda: run.poll() is not None or list((folder / "careers").glob("*.json")), "a career", 600.0)
        assert run.poll() is None
        os.kill(run.pid, signal.SIGINT)
        assert run.wait(30) == 130
    kept = len(list((folder / "careers").glob("*.json")))
    assert 0 < kept < 4
    assert without_time(study(folder, "--conditions", "ideal,water", "--resume")) == without_time(first)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--conditions", "swimming"), "swimming"),
        (("--participants", "three"), "--participants"),
        (("--sessions", "1,2,3"), "--sessions"),
        (("--windows", "99"), "--windows"),
        (("--constant", "luck=1"), "luck"),
        (("--constant", "width"), "NAME=VALUE"),
        (("--processes", "0"), "--processes"),
        (("--resume",), "--resume"),
    ],
)
def test_a_wrong_option_is_named_and_nothing_begins(tmp_path, words, says):
    run = exograv("simulate-study", "--out", str(tmp_path / "s"), *words)
    assert run.returncode == 1
    assert says in run.stderr
    assert "Traceback" not in run.stderr
    assert not (tmp_path / "s").exists()
