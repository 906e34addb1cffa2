"""No wrong input makes a traceback: each is answered in one line, with an exit status that a script can use."""

import math
import sys
from pathlib import Path

import pytest
import tyro

from exograv import cli
from exograv.cli.shell.command import command_class, options_of
from exograv.cli.shell.spellings import has_machine
from exograv.options import PersonCode, Within

URDF = str(Path(__file__).parents[1] / "robots" / "recupera_like" / "right.urdf")
LOG = ["none.csv", "--unloaded", "none.csv", "--urdf", URDF, "--payload-frame", "upper_arm_cuff", "--gains", "1,2,3,4"]
NEEDED = {
    "report": ["none.mcap"], "rig new": ["none.urdf"], "arm identify-log": LOG, "data replay": ["none.mcap"],
    "data sync": ["none.mcap"], "dev sweep": ["none.toml"], "study init": ["s"], "study participant": ["s"],
    "study identity": ["s"], "study add": ["s", "f"], "study export": ["--bids", "b"],
}  # fmt: skip

WRONG = "?!"
"""Word that is no number and no choice of any option."""


def wrong_words(path: str) -> list[list[str]]:
    """Words of command lines that cannot be used."""
    kind = command_class(cli.ACTIONS[path])
    found = [["--json", "folder"], ["--json", "file/x.json"], ["--write-settings", "file/x.toml"], ["--no-such-option"]]
    found += [["--settings", name] for name in ("none.toml", "folder", "bytes", "")]
    if has_machine(kind):
        found += [["--rig"], ["--rig="], ["--rig=--level", "2"]]
    for option in options_of(kind):
        if any(name in str(option.kind) for name in ("int", "float", "Literal")):
            found += [[WRONG if tyro.conf.Positional in option.marks else f"{option.flag}={WRONG}"]]
        for mark in option.marks:
            if isinstance(mark, Within):
                values = [math.nan, mark.low - 1] if "float" in str(option.kind) else [mark.low - 1, "x"]
                found += [[f"{option.flag}={value}"] for value in values]
            elif isinstance(mark, PersonCode):
                found += [[f"{option.flag}={text}"] for text in ("anna", "", "../x", "a b")]
    return found


@pytest.mark.parametrize("path", sorted(cli.ACTIONS))
def test_a_wrong_option_is_answered_in_one_line(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "folder").mkdir()
    (tmp_path / "bytes").write_bytes(b"\xff\xfe")
    for words in wrong_words(path):
        monkeypatch.setattr(sys, "argv", ["exograv", *path.split(), *NEEDED.get(path, []), *words])
        with pytest.raises(SystemExit) as end:
            cli.main()
        error = capsys.readouterr().err
        assert end.value.code in (1, 2), words
        assert error.startswith("exograv: "), (words, error)
        assert error.count("\n") == 1, (words, error)
        if words[0].endswith(f"={WRONG}"):
            assert error.startswith(f"exograv: {words[0].partition('=')[0]} "), error
            assert f"'{WRONG}'" in error


@pytest.mark.parametrize("path", sorted(set(NEEDED) - {"study init", "study export"}))
def test_a_file_that_does_not_exist_is_named(
    path: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["exograv", *path.split(), *NEEDED[path]])
    with pytest.raises(SystemExit) as end:
        cli.main()
    # A slow computer shows the phase before the file is opened.
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith("[")]
    assert end.value.code == 1
    assert len(lines) == 1
    assert NEEDED[path][0] in lines[0]
