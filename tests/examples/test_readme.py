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


@pytest.mark.slow
def test_the_lines_of_readme_float_an_arm(tmp_path: Path):
    command = [sys.executable, "-c", first_block("README.md")]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    run = subprocess.run(command, check=False, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert run.returncode == 0, run.stderr
    assert "Drift" in run.stdout
    assert (tmp_path / "flight.png").is_file()
