"""A command names the one that usually follows, with the same machine, as words that the command line accepts."""

import shlex
from pathlib import Path

import pytest

from exograv import cli
from exograv.live.options import RigTestOptions
from exograv.next_command import same_machine
from exograv.options import MachineOptions
from exograv.procedures.calibration.options import CalibrateOptions
from exograv.procedures.rehabilitation.guided.options import MirrorOptions


def test_a_default_machine_needs_no_words():
    assert same_machine("rig calibrate", RigTestOptions(simulate=True)) == "exograv rig calibrate --simulate"


@pytest.mark.parametrize("command", ["rig calibrate", "rig self-test", "run live"])
def test_the_next_command_has_the_machine_of_the_last_one(command: str):
    options = CalibrateOptions(rig="my_machine", side="left", level=1, seed=7, simulate=True)
    words = same_machine(command, options, Path("bench")).split()
    assert words[0] == "exograv"
    path, rest = cli.resolved(words[1:])
    parsed = cli.parsed(path, rest)
    assert path == command
    assert (parsed.rig, parsed.side, parsed.level, parsed.seed, parsed.simulate, parsed.out) == (
        "my_machine", "left", 1, 7, True, Path("bench"),
    )  # fmt: skip


def test_a_real_machine_keeps_its_file_of_drives():
    options = CalibrateOptions(drives=Path("drives.toml"))
    assert same_machine("rig self-test", options) == "exograv rig self-test --drives drives.toml"


def test_a_machine_that_is_the_default_of_one_command_only_is_named():
    options = MirrorOptions()
    assert options.rig != MachineOptions.rig
    assert same_machine("rig calibrate", options) == f"exograv rig calibrate {options.rig}"


def test_a_path_with_a_space_stays_one_word():
    options = CalibrateOptions(drives=Path("my drives.toml"))
    words = shlex.split(same_machine("rig self-test", options, Path("my bench")))
    assert words[-4:] == ["--drives", "my drives.toml", "--out", "my bench"]
