"""The file of a taught path is in the folder of --out, unless --path names another one."""

import shlex
from dataclasses import dataclass
from pathlib import Path

import pytest

from exograv import cli
from exograv.cli.shell.command import checked_parts

CODE = "K7MR4XX"


class ReachedError(Exception):
    """The command would run with this file."""


@dataclass(frozen=True)
class Found:
    """Figures of a taught path, as far as the terminal shows them."""

    path: Path
    seconds: float = 1.0
    stretched: float = 1.0


@dataclass(frozen=True)
class Result:
    """Result of a session of teaching."""

    found: Found


def ran(words: list[str]) -> None:
    path, rest = cli.resolved(words)
    cli.ACTIONS[path](**checked_parts(cli.ACTIONS[path], cli.parsed(path, rest)))


@pytest.mark.parametrize("command", ["teach", "repeat"])
@pytest.mark.parametrize(("words", "file"), [([], "bench/path.toml"), (["--path", "raise.toml"], "raise.toml")])
def test_a_path_is_in_the_folder_of_out_or_where_path_says(
    command: str, words: list[str], file: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    def reached(_options: object, path: Path, *_more: object) -> None:
        raise ReachedError(path)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(f"exograv.laboratory.guided.guided_command.run_{command}", reached)
    with pytest.raises(ReachedError) as at:
        ran(["run", command, "--out", "bench", *words])
    assert at.value.args == (Path(file),)


@pytest.mark.parametrize("words", [[], ["--path", "raise.toml"]])
def test_the_command_that_teach_prints_repeats_that_path(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
):
    def taught(_options: object, path: Path, *_more: object) -> Result:
        return Result(Found(path))

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("exograv.laboratory.guided.guided_command.run_teach", taught)
    ran(["run", "teach", "--seed", "7", "--code", CODE, "--out", "bench", *words])
    printed = capsys.readouterr().out
    name, rest = cli.resolved(shlex.split(printed.partition("exograv ")[2]))
    parsed = cli.parsed(name, rest)
    assert (name, parsed.seed, parsed.code, parsed.out) == ("run repeat", 7, CODE, Path("bench"))
    assert parsed.path == (Path(words[1]) if words else None)
