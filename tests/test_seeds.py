"""A run without long tests keeps the first seed of each sweep with every other parameter, and no further seed."""

import os
import subprocess
import sys
from pathlib import Path

SWEEP = """
import pytest

@pytest.mark.parametrize("rig", ["one", "two"])
@pytest.mark.parametrize("seed", [1000, 1001, 1002])
def test_sweep(rig, seed):
    pass

def test_without_seed():
    pass
"""
CONFTEST = """
import pytest
from tests import seeds

@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    seeds.mark_further(items)
"""


def collected(folder: Path, *words: str) -> set[str]:
    (folder / "test_sweep.py").write_text(SWEEP, encoding="utf-8")
    (folder / "conftest.py").write_text(CONFTEST, encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", f"--rootdir={folder}", "-q", "--collect-only"]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run([*command, str(folder), *words], capture_output=True, text=True, check=True, env=environment)
    return {line.partition("::")[2] for line in done.stdout.splitlines() if "::" in line}


def test_the_first_seed_of_a_sweep_stays_with_every_other_parameter(tmp_path: Path):
    assert collected(tmp_path, "-m", "not long") == {
        "test_sweep[1000-one]",
        "test_sweep[1000-two]",
        "test_without_seed",
    }


def test_a_run_of_all_tests_has_every_seed(tmp_path: Path):
    assert len(collected(tmp_path)) == 7
