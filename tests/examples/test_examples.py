"""Every numbered example runs to its end, alone, and prints the expected line."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from tests.console.of_process import console
from tests.preloaded import script

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("[0-9]*.py"))
QUICK = ("01", "04", "06", "09")
"""Examples that take a few seconds."""

PRINTED = {
    "01": "weightless",
    "02": "Drift of the floating arm",
    "03": "The arm of the file is the same: True",
    "04": "torque at the donning posture",
    "05": "A law that returns NaN: The run was stopped",
    "06": "Figure: out/floating.png",
    "07": "gradient-full",
    "08": "touches, windows, sessions, participants",
    "09": "accepted",
}


def test_every_example_has_its_promise():
    assert [path.name[:2] for path in EXAMPLES] == list(PRINTED)


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, id=p.stem, marks=() if p.name[:2] in QUICK else pytest.mark.long) for p in EXAMPLES],
)
def test_the_example_runs_to_its_end(path: Path, tmp_path: Path):
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "PYTHONWARNINGS": "error"}
    run = script(path, folder=tmp_path, environment=environment)
    assert PRINTED[path.name[:2]] in run.stdout


@pytest.mark.slow
def test_the_page_of_the_example_steers_a_console(tmp_path: Path):
    page = Path(__file__).parents[2] / "examples" / "console_page" / "page.py"
    with console("--rehearse", "--out", tmp_path) as (_process, link):
        run = subprocess.run([sys.executable, page, link], capture_output=True, text=True, check=True)
    assert run.stdout.count("'taken': True") == 2
