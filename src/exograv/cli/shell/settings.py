"""Settings files: the options of commands from a TOML file, and the options in force as such a file.

A table has the name of a command, such as `[run.train]`. Keys at the top of the file, or of a group such as `[run]`,
hold for every command that has such an option.
"""

import difflib
import json
import textwrap
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any

import tyro

from exograv.errors import ConfigError

from .base_options import Common
from .command import Action, Option, command_class, options_of

NOT_IN_FILES = ("settings", "write-settings")
WIDTH = 100
"""Length of a comment in a written file [characters]."""


def options_by_key(kind: type[Common]) -> dict[str, Option]:
    """Return the options that may stand in a settings file, by their key."""
    return {one.key: one for one in options_of(kind) if one.key not in NOT_IN_FILES}


def with_settings(file: Path, path: str, actions: Mapping[str, Action], words: list[str]) -> Common:
    """Return the options of a command with the values of a settings file in place of its defaults.

    Args:
        file: Settings file.
        path: Full name of the command.
        actions: All commands by full name.
        words: Words of the command line; a repeatable option that is given there replaces the list of the file.

    Raises:
        ConfigError: The file cannot be read, or it has a key or value that is not allowed.
    """
    kind = command_class(actions[path])
    known, content = options_by_key(kind), _read(file)
    values = {field.name: _default(field) for field in fields(kind)}
    for where, key, value in _settings_for(content, path, actions, file):
        option = known.get(key)
        if option is None:  # Shared by other commands.
            continue
        is_replaced = option.is_repeatable and any(word.partition("=")[0] == option.flag for word in words)
        if not is_replaced:
            values[option.field] = _typed(option, value, f"{file}: {key} {where}", path)
    return kind(**values)


def _default(field: Any) -> Any:
    return field.default_factory() if field.default_factory is not MISSING else field.default


def _read(file: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except OSError as error:
        raise ConfigError(f"--settings {file} cannot be read: {error.strerror}. Give another file.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"--settings {file} is no TOML file: {error}. Correct the file.") from error


def _settings_for(
    content: Mapping[str, Any], path: str, actions: Mapping[str, Action], file: Path
) -> Iterator[tuple[str, str, Any]]:
    """Check all names in a file. Yield place, key and value for one command, from the most general to its own table."""
    levels: dict[str, dict[str, Any]] = {}
    _sort(content, "", actions, levels, file)
    words = path.split()
    for name in ("", *(" ".join(words[:count]) for count in range(1, len(words) + 1))):
        where = f"in [{name.replace(' ', '.')}]" if name else "at the top"
        for key, value in levels.get(name, {}).items():
            yield where, key, value


def _sort(
    content: Mapping[str, Any], name: str, actions: Mapping[str, Action], levels: dict[str, dict[str, Any]], file: Path
) -> None:
    """Sort keys by the table that they stand in, with hyphens for underscores."""
    below = [path for path in actions if path == name or not name or path.startswith(f"{name} ")]
    tables = {path.removeprefix(name).split()[0] for path in below if path != name}
    known = {key for path in below for key in options_by_key(command_class(actions[path]))}
    levels[name] = {}
    for written, value in content.items():
        key = written.replace("_", "-")
        if isinstance(value, Mapping) and written in tables:
            _sort(value, f"{name} {written}".strip(), actions, levels, file)
        elif key in known:
            levels[name][key] = value
        else:
            _refuse_unknown(written, value, name, known, tables, file)


def _refuse_unknown(written: str, value: object, name: str, known: set[str], tables: set[str], file: Path) -> None:
    is_table = isinstance(value, Mapping) and bool(tables)
    kind, names = ("command or group", tables) if is_table else ("option", known)
    near = difflib.get_close_matches(written.replace("_", "-"), sorted(names), n=3, cutoff=0.6)
    meant = f" Did you mean: {', '.join(near)}?" if near else ""
    where = f" in [{name.replace(' ', '.')}]" if name else ""
    raise ConfigError(f"{file}{where} has '{written}', which is no {kind}.{meant} Allowed: {', '.join(sorted(names))}.")


def _typed(option: Option, value: object, where: str, path: str) -> Any:
    """Return a value of a TOML file as a value of the option.

    Raises:
        ConfigError: The value has another type, or is not allowed.
    """
    from pydantic import TypeAdapter, ValidationError

    reader = next((one for one in option.marks if isinstance(one, tyro.constructors.PrimitiveConstructorSpec)), None)
    if reader is not None:
        return reader.instance_from_str(_words(value))
    try:
        # JSON knows neither paths nor tuples, so its strict mode takes a text for a path, but not for a number.
        return TypeAdapter(option.kind).validate_json(json.dumps(value, default=str), strict=True)
    except ValidationError as error:
        why = "; ".join(dict.fromkeys(one["msg"] for one in error.errors()))
        raise ConfigError(f"{where} is {value!r}. {why}. `exograv {path} --help` shows what is allowed.") from error


def _words(value: object) -> list[str]:
    """Return a value as the words of the command line that an option with a reader of its own takes."""
    if isinstance(value, Mapping):
        return [f"{name}={number}" for name, number in value.items()]
    return [",".join(map(str, value)) if isinstance(value, list) else str(value)]


def write_settings(file: Path, path: str, command: Common) -> None:
    """Write the options in force, with their help texts as comments. Tables of other commands in the file are kept.

    Raises:
        ConfigError: The file exists and is no settings file.
        RecordingError: The file cannot be written.
    """
    import tomlkit

    from exograv.files import write_whole

    document = tomlkit.parse(file.read_text(encoding="utf-8")) if file.exists() and _read(file) else tomlkit.document()
    *groups, name = path.split()
    place: Any = document
    for group in groups:
        place = place.setdefault(group, tomlkit.table(is_super_table=True))
    table = tomlkit.table()
    for option in options_by_key(type(command)).values():
        for line in textwrap.wrap(option.help, WIDTH):
            table.add(tomlkit.comment(line))
        value = _plain(getattr(command, option.field))
        table.add(tomlkit.comment(f"{option.key} is not given.")) if value is None else table.add(option.key, value)
        table.add(tomlkit.nl())
    place[name] = table
    write_whole(file, tomlkit.dumps(document))


def _plain(value: Any) -> Any:
    import tomlkit

    if isinstance(value, Mapping):
        inline = tomlkit.inline_table()
        inline.update(value)
        return inline
    if isinstance(value, tuple | list):
        return [_plain(one) for one in value]
    return str(value) if isinstance(value, Path) else value
