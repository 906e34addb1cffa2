"""Former spellings of options. They are not shown in any help, but documents and scripts that use them still run."""

from typing import get_args, get_type_hints

import tyro

from exograv.errors import ConfigError
from exograv.options import Bus

MACHINE = "rig"
SIMULATE = "--simulate"


def has_machine(command: type) -> bool:
    """Return True if the command acts on a machine, which is then its first positional argument."""
    hint = get_type_hints(command, include_extras=True).get(MACHINE)
    return tyro.conf.Positional in getattr(hint, "__metadata__", ())


def present_spelling(command: type, words: list[str]) -> list[str]:
    """Return the words of a command line with each former spelling replaced.

    `--rig NAME` becomes the first word. `--simulate` is left out of commands that can only simulate. The bus of
    `dev drive-sim` was its first word.

    Raises:
        ConfigError: `--rig` has no value.
    """
    if not has_machine(command):
        return words
    hints = get_type_hints(command)
    if hints.get("bus") == Bus and words and words[0] in get_args(Bus):
        words = ["--bus", *words]
    if "simulate" not in hints:
        words = [word for word in words if word not in (SIMULATE, "--no-simulate")]
    return _machine_first(words)


def value_of(flag: str, words: list[str]) -> str | None:
    """Return the last value of a flag on the command line; None if it is not there."""
    pairs = zip(words, [*words, ""][1:], strict=True)
    given = [after if word == flag else word.partition("=")[2] for word, after in pairs if word.split("=")[0] == flag]
    return given[-1] if given else None


def _machine_first(words: list[str]) -> list[str]:
    others, machine, given = list[str](), None, iter(words)
    for word in given:
        name, equals, value = word.partition("=")
        if name != f"--{MACHINE}":
            others.append(word)
            continue
        machine = value if equals else next(given, None)
        if not machine or machine.startswith("--"):
            raise ConfigError("--rig has no value; give the name of a machine (see `exograv rigs`), or its folder.")
    return others if machine is None else [machine, *others]
