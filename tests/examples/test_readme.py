"""The Python lines of README and of the documentation's start page run as they stand."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def first_block(page: str) -> str:
    """First block of Python of a page."""
    return re.findall(r"```python\n(.*?)```", (ROOT / page).read_text(encoding="utf-8"), flags=re.DOTALL)[0]


def test_the_start_page_shows_lines_of_readme():
    shared = [
        line for line in first_block("docs/start/python.md").splitlines() if line and not line.startswith("machine")
    ]
    assert set(shared) <= set(first_block("README.md").splitlines())


SIMULATED_DRIVES = "machine = exograv.Drives(rig, simulate=True, level=2, seed=1)"


def run_script(lines: str, folder: Path) -> str:
    """Run lines as a reader does, as a script of their own; return what they print."""
    (folder / "script.py").write_text(lines, encoding="utf-8")
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(
        [sys.executable, "script.py"], check=False, cwd=folder, env=environment, capture_output=True, text=True
    )
    assert run.returncode == 0, run.stdout + run.stderr
    return run.stdout


@pytest.mark.long
def test_the_lines_of_readme_float_an_arm(tmp_path: Path):
    assert "Drift" in run_script(first_block("README.md"), tmp_path)
    assert (tmp_path / "flight.png").is_file()


@pytest.mark.slow
def test_the_same_lines_with_another_machine_float_an_arm_on_drives(tmp_path: Path):
    lines, replaced = re.subn(r"machine = .*", SIMULATED_DRIVES, first_block("README.md"))
    assert replaced == 1
    assert "Left over, true" in run_script(lines, tmp_path)
    assert (tmp_path / "flight.png").is_file()
