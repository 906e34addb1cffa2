"""The end of a test run says where its time went."""

import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

from tests.times import room_of, summary

BUSY = """
import subprocess, sys, time

def spend(seconds):
    end = time.process_time() + seconds
    while time.process_time() < end:
        pass

def test_idle():
    pass

def test_busy():
    spend(0.4)

def test_busy_child():
    subprocess.run([sys.executable, "-c", "import time\\nwhile time.process_time() < 0.8: pass"], check=True)
"""


def run(folder: Path, *words: str) -> list[str]:
    (folder / "test_busy.py").write_text(BUSY, encoding="utf-8")
    plugins = [word for name in ("xdist", "tests.times", "no:cacheprovider") for word in ("-p", name)]
    command = [sys.executable, "-m", "pytest", *plugins, f"--rootdir={folder}", str(folder), *words]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1"}
    done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
    return done.stdout.splitlines()


def test_the_slowest_tests_are_named_with_the_time_of_their_children(tmp_path: Path):
    lines = run(tmp_path, "--numprocesses", "1")
    slowest = [line.split() for line in lines[lines.index("The slowest tests:") + 1 :] if "::" in line]
    assert [name.partition("::")[2] for _, _, name in slowest] == ["test_busy_child", "test_busy", "test_idle"]
    assert float(slowest[0][0]) >= 0.7
    assert 0.4 <= float(slowest[1][0]) < float(slowest[0][0])


def test_a_quiet_run_is_quiet(tmp_path: Path):
    assert not [line for line in run(tmp_path, "-q", "-k", "idle") if "slowest" in line]


def test_times_are_summed_by_room():
    spent = Counter({"tests/rig/a.py::x": 1.0, "tests/rig/deep/b.py::y[1]": 2.0, "tests/test_z.py::z": 0.5})
    lines = summary(spent, [4.0, 5.0])
    assert [line.split(None, 2)[0::2] for line in lines[:4]] == [
        ["3.0", "rig, 2 tests"],
        ["0.5", "tests, 1 tests"],
        ["9.0", "start and collection, 2 processes"],
        ["12.5", "sum"],
    ]


def test_a_file_outside_of_all_rooms_counts_for_the_folder():
    assert room_of("tests/test_cli.py::test_x") == "tests"
    assert room_of("tests/rig/drives/test_y.py::test_x") == "rig"
