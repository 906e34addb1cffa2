"""The seeds of every fuzz target are good inputs, a crash is reported, and its input can be read again."""

import random
import subprocess
import sys
from pathlib import Path

import pytest

from fuzz import run

ROOT = Path(__file__).parents[3]
CHANGES = 100


def changed(data: bytes, size: int) -> bytes:
    """Change one byte, as the simplest of all fuzzers."""
    dice, content = random.Random(len(data)), bytearray(data or b"x")
    content[dice.randrange(len(content))] = dice.randrange(256)
    return bytes(content[:size])


@pytest.mark.parametrize("name", run.TARGETS)
def test_neither_a_seed_nor_a_changed_seed_is_a_crash(name: str):
    one = run.target(name)
    seeds = one.seeds()
    assert seeds
    mutate = getattr(one, "mutate", lambda data, size, seed, change: change(data, size))
    for seed in seeds:
        one.read(seed)
    for number in range(CHANGES):
        one.read(mutate(seeds[number % len(seeds)], run.LENGTH_MAX, number, changed))


def test_an_input_is_read_again_by_the_command_that_a_crash_prints(tmp_path: Path):
    (tmp_path / "crash-1").write_bytes(b"EXGV")
    command = [sys.executable, "benchmarks/fuzz/run.py", "--repeat", "udp_packets", str(tmp_path / "crash-1")]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert "is no crash of udp_packets any more" in result.stdout


def test_the_figures_of_a_log_are_its_last_ones():
    log = """#2 INITED cov: 5 ft: 6 corp: 1/1b exec/s: 0 rss: 70Mb
#64 DONE cov: 23 ft: 30 corp: 9/90b exec/s: 32 rss: 71Mb
stat::number_of_executed_units: 64
stat::average_exec_per_sec:     31
"""
    assert run.figures(log) == "64 inputs, 31 per second, 23 branches reached"
