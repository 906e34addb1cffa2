"""`benchmarks/kernels.py` keeps its contract and refuses in one line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from peers.ratios import RATIOS

SCRIPT = Path(__file__).parents[3] / "benchmarks" / "kernels.py"
ROWS = ("rnea_4", "rnea_7", "torque_gradient_7", "tick_aligned_7", "tick_general_4", "tick_general_7")
FASTER_THAN = 1.0  # a median slower than Pinocchio's means a broken compiler, even on a busy computer


def kernels(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *words]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--save", "."), "Give another path with --save"),
        (("--compare", "none.json"), "none.json cannot be read"),
    ],
)
def test_a_run_that_could_not_be_kept_or_compared_is_refused_at_once(words, message: str, tmp_path: Path):
    result = kernels("--quick", *words, folder=tmp_path)
    assert result.returncode == 1
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_quick_run_keeps_the_contract(tmp_path: Path):
    result = kernels("--quick", "--save", "run.json", folder=tmp_path)
    assert result.returncode == 0, result.stderr
    run = json.loads((tmp_path / "run.json").read_text())
    assert set(run["ratios"]) == set(RATIOS)
    names = {row["name"] for row in run["rows"] if row["implementation"] == "exograv native"}
    assert names.issuperset(ROWS)
    assert {f"batch_rnea_7_{size}_f64_one_core" for size in (1, 64, 1024, 16384)} <= names
    assert all(row["error_vs_reference"] <= 1e-4 for row in run["rows"])
    assert run["ratios"]["rnea_vs_pinocchio"] > FASTER_THAN
