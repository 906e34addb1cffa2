"""The help of every command fits a narrow terminal, and a reader that closes the pipe early causes no message."""

import contextlib
import io
import os
import subprocess
import sys

import pytest

from exograv import cli
from exograv.cli.shell.command import command_class, options_of

PATHS = ["", *cli.GROUPS, *cli.ACTIONS]
COLUMNS = 40

CLOSED_PIPE = """
import os, sys
from exograv import cli

for path in ["", *cli.GROUPS, *cli.ACTIONS]:
    said, told = os.pipe()
    errors, heard = os.pipe()
    child = os.fork()
    if child == 0:
        os.dup2(told, 1)
        os.dup2(heard, 2)
        for one in (said, errors, told, heard):
            os.close(one)
        sys.stdout = open(1, "w", closefd=False)
        sys.stderr = open(2, "w", closefd=False)
        sys.argv = ["exograv", *path.split(), "--help"]
        try:
            cli.main()
        except SystemExit as end:
            sys.stderr.flush()
            os._exit(end.code if isinstance(end.code, int) else 0)
        os._exit(0)
    os.close(said)
    os.close(told)
    os.close(heard)
    text = open(errors).read()
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if text or status not in (0, 141):
        print(path, status, text)
"""


def help_of(path: str, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr(sys, "argv", ["exograv", *path.split(), "--help"])
    text = io.StringIO()
    with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
        cli.main()
    return text.getvalue()


@pytest.mark.parametrize("path", PATHS)
def test_no_line_of_a_help_is_longer_than_a_narrow_terminal(path: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    lines = help_of(path, monkeypatch).splitlines()
    assert len(lines) > 5
    assert [line for line in lines if len(line) > COLUMNS] == []


@pytest.mark.parametrize("path", sorted(cli.ACTIONS))
def test_every_option_has_a_help_text(path: str):
    options = options_of(command_class(cli.ACTIONS[path]))
    assert [one.flag for one in options if not one.help.endswith((".", ")"))] == []


@pytest.mark.long
@pytest.mark.skipif(sys.platform == "win32", reason="os.fork")
def test_the_reader_of_a_help_may_close_the_pipe_at_once():
    result = subprocess.run([sys.executable, "-c", CLOSED_PIPE], capture_output=True, text=True, check=True)
    assert result.stdout == ""


class Terminal(io.StringIO):
    """Output that looks like a terminal."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("no_color", "is_coloured"), [("1", False), ("", True)])
def test_a_help_has_colours_on_a_terminal_only_without_no_color(
    no_color: str, is_coloured: bool, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("NO_COLOR", no_color)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr(sys, "argv", ["exograv", "run", "live", "--help"])
    text = Terminal()
    with contextlib.redirect_stdout(text), contextlib.suppress(SystemExit):
        cli.main()
    assert "--gravity-level" in text.getvalue()
    assert ("\x1b[" in text.getvalue()) == is_coloured
    assert os.environ["TERM"] == "xterm-256color"
