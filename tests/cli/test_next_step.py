"""A command names the one that usually follows, with the same machine, as words that the command line accepts."""

from pathlib import Path

import pytest

from exograv import cli
from exograv.cli.shell.next_step import same_machine
from exograv.live.options import RigTestOptions
from exograv.procedures.calibration.options import CalibrateOptions


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
