"""A settings file stands for options of every command, and the command line has priority over it."""

import tomllib
from collections.abc import Mapping
from dataclasses import MISSING, fields, replace
from pathlib import Path
from types import NoneType
from typing import Any, get_args

import pytest

from exograv.cli import ACTIONS, parsed
from exograv.cli.shell.command import Option, checked_parts, command_class
from exograv.cli.shell.settings import options_by_key, write_settings
from exograv.errors import ConfigError

OTHER: dict[object, Any] = {int: 3, float: 0.5, str: "K7", Path: Path("a/b")}
MANY = {
    "levels": (1, 3), "plan_workers": (5, 6), "methods": ("gradient",), "profiles": ("qdd",), "gains": (1.5, 2.0),
    "participants": (2, 1), "sessions": (3, 2), "compared": (2, 2), "aircraft": (4000,), "constants": {"width": 0.5},
    "files": (Path("a.mcap"), Path("b.mcap")), "recordings": (Path("a.mcap"), Path("b.mcap")),
    "unloaded": (Path("a.csv"), Path("b.csv")),
}  # fmt: skip


def other_value(option: Option, default: Any) -> Any:
    """Value that differs from the default."""
    several = MANY.get(option.field)
    if several is not None and (
        isinstance(several, Mapping) or "tuple" in str(option.kind) or "Seq" in str(option.kind)
    ):
        return several
    if isinstance(default, bool):
        return not default
    if isinstance(default, tuple):
        return ("x", "y")
    if choices := [one for one in _flat(option.kind) if isinstance(one, str) and one != default]:
        return choices[-1]
    return next(OTHER[kind] for kind in _flat(option.kind) if kind in OTHER)


def _flat(kind: Any) -> list[Any]:
    parts = [part for part in get_args(kind) if part is not NoneType]
    return [one for part in parts for one in _flat(part)] if parts else [kind]


def changed(path: str) -> Any:
    """Options of a command, each different from its default."""
    kind: Any = command_class(ACTIONS[path])
    values = {
        one.name: one.default if one.default_factory is MISSING else one.default_factory() for one in fields(kind)
    }
    return kind(**values | {one.field: other_value(one, values[one.field]) for one in options_by_key(kind).values()})


def read(path: str, text: str, folder: Path, *words: str) -> Any:
    (folder / "s.toml").write_text(text)
    return parsed(path, ["--settings", str(folder / "s.toml"), *words])


@pytest.mark.parametrize("path", sorted(ACTIONS))
def test_options_written_to_a_file_are_read_back_unchanged(path: str, tmp_path: Path):
    file, command = tmp_path / "s.toml", changed(path)
    write_settings(file, path, command)
    assert parsed(path, ["--settings", str(file)]) == replace(command, settings=file)


@pytest.mark.parametrize("path", sorted(ACTIONS))
def test_each_written_option_has_its_help_text_above(path: str, tmp_path: Path):
    write_settings(tmp_path / "s.toml", path, changed(path))
    lines = (tmp_path / "s.toml").read_text().splitlines()
    keys = [k for k, line in enumerate(lines) if line and not line.startswith(("#", "["))]
    assert len(keys) == len(options_by_key(command_class(ACTIONS[path])))
    assert all(lines[k - 1].startswith("# ") for k in keys)


def test_tables_of_other_commands_stay_in_the_file(tmp_path: Path):
    for path in ("run train", "run live", "demo"):
        write_settings(tmp_path / "s.toml", path, changed(path))
    content = tomllib.loads((tmp_path / "s.toml").read_text())
    assert {*content} == {"run", "demo"}
    assert {*content["run"]} == {"train", "live"}


def test_the_command_line_has_priority_over_the_file(tmp_path: Path):
    text = '[data.streams]\nrecord = ["EEG"]\nseconds = 5.0\n'
    assert read("data streams", text, tmp_path).record == ("EEG",)
    told = read("data streams", text, tmp_path, "--record", "EMG", "--record=ECG")
    assert (told.record, told.seconds) == (("EMG", "ECG"), 5.0)
    assert read("run train", "[run.train]\nresume = true\n", tmp_path, "--no-resume").resume is False
    assert read("demo", '[demo]\nrig = "mine"\n', tmp_path, "--rig", "yours").rig == "yours"


def test_the_nearest_table_wins_and_shared_keys_reach_every_command_that_has_them(tmp_path: Path):
    text = (
        'seed = 1\nout = "a"\nlevel = 1\n[run]\nseed = 2\n[run.train]\nseed = 3\nverify-every = 4\n[demo]\nlevel = 4\n'
    )
    train, teach, demo = (read(path, text, tmp_path) for path in ("run train", "run teach", "demo"))
    assert (train.seed, train.level, train.verify_every, train.out) == (3, 1, 4, Path("a"))
    assert (teach.seed, demo.seed, demo.level) == (2, 1, 4)
    assert read("rigs", text, tmp_path).json is None


def test_hyphens_and_underscores_mean_the_same(tmp_path: Path):
    for key in ("gravity-level", "gravity_level"):
        assert read("demo", f"[demo]\n{key} = 0.5\n", tmp_path).gravity_level == 0.5


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("[demo]\nsede = 1\n", r"in \[demo\] has 'sede', which is no option. Did you mean: side, seed\? Allowed: ca"),
        ("verify_evry = 1\n", r"has 'verify_evry', which is no option. Did you mean: verify-every"),
        ("[run.trian]\nseed = 1\n", r"in \[run\] has 'trian', which is no command or group. Did you mean: train"),
        ("[demo]\nonly_identify = true\n", "'only_identify', which is no option"),
        ("[demo]\nsettings = 'b.toml'\n", "'settings', which is no option"),
        ("[demo]\nseed = 'x'\n", r"seed in \[demo\] is 'x'\. Input should be a valid integer.*exograv demo --help"),
        ("[demo]\nseed = '1'\n", "Input should be a valid integer"),
        ("[demo]\nmethod = 'least'\n", "Input should be 'recursive',"),
        ("[demo\n", "is no TOML file: Expected ']'"),
    ],
)  # fmt: skip
def test_a_wrong_file_is_refused_with_place_and_allowed_names(text: str, message: str, tmp_path: Path):
    with pytest.raises(ConfigError, match=message):
        read("demo", text, tmp_path)


def test_a_value_outside_its_range_is_refused_with_the_sentence_of_the_command_line(tmp_path: Path):
    command = read("demo", "[demo]\nlevel = 7\n", tmp_path)
    with pytest.raises(ConfigError, match="--level is 7; allowed: 0"):
        checked_parts(ACTIONS["demo"], command)


@pytest.mark.parametrize("file", [".", "none.toml"])
def test_a_file_that_cannot_be_read_is_named(file: str):
    with pytest.raises(ConfigError, match=f"--settings {file} cannot be read"):
        parsed("demo", [f"--settings={file}"])
