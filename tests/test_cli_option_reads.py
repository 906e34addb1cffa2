"""An option exists only where it acts: the code of its command reads it."""

from dataclasses import dataclass

import pytest
from tests.option_reads import options_read

from exograv.cli import ACTIONS, parsed
from exograv.cli.shell.base_options import Common
from exograv.cli.shell.command import option_classes, options_of

READ_FOR_ALL = {one.field for one in options_of(Common)}
"""Options that the command line itself reads."""


@dataclass(frozen=True)
class Idle:
    """Options of a command that reads one of two."""

    used: int = 0
    idle: int = 0


def run_idle(command: Idle) -> int:
    """Read one option of two."""
    return _through(command)


def _through(asked: Idle) -> int:
    return asked.used


def test_an_option_that_no_code_reads_is_found():
    assert options_read(__name__, "run_idle", Idle) == {"used"}


@pytest.mark.parametrize("path", sorted(ACTIONS))
def test_a_command_reads_each_of_its_options(path: str):
    action = ACTIONS[path]
    for kind in option_classes(action).values():
        read = options_read(action.__module__, action.__name__, kind)
        assert [one.flag for one in options_of(kind) if one.field not in read | READ_FOR_ALL] == []


@pytest.mark.parametrize("path", ["rigs", "demo", "doctor"])
def test_a_command_needs_no_words(path: str):
    assert parsed(path, []).json is None
