"""Advice on an option that a command does not have, where the parser of the command line has none."""

import difflib
from collections.abc import Mapping, Sequence

from .command import Action, command_class, options_of


def advice(path: str, words: Sequence[str], actions: Mapping[str, Action]) -> str | None:
    """Say what the first unknown option on the command line may mean; None if there is nothing to add.

    The parser itself proposes similar options of the same command. It misses an option with one dash, and an option
    of another command.

    Args:
        path: Name of the command.
        words: Words after the name.
        actions: All commands.
    """
    own = _flags(actions[path])
    for word in words:
        name = word.partition("=")[0]
        if not name.startswith("-") or name in own or not name.strip("-")[:1].isalpha() or name in ("-h", "--help"):
            continue
        if not name.startswith("--"):
            near = difflib.get_close_matches(f"-{name}", own, n=1)
            return f"An option has two dashes: did you mean {near[0]}?" if near else "An option has two dashes."
        others = [other for other, action in actions.items() if name in _flags(action)]
        if others:
            listed = ", ".join(others[:4]) + (", …" if len(others) > 4 else "")
            return f"`exograv {path}` has no option {name}; these commands have it: {listed}."
    return None


def _flags(action: Action) -> list[str]:
    return [option.flag for option in options_of(command_class(action))]
