"""Sentence on the first word of a command line that a command cannot use: the word, what is allowed, what to do next.

The parser of the command line decides which words are wrong. It only frames the message of Python, such as "invalid
literal for int()", so the sentence is made here.
"""

import difflib
import types
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import MISSING, fields
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin

import tyro

from exograv.options import Within

from .command import Action, Option, command_class, options_of


class _Command(NamedTuple):
    """Options of a command as its command line takes them."""

    path: str
    flags: dict[str, Option]
    places: list[Option]
    """Options without a flag, in their order."""

    def option(self, word: str) -> Option | None:
        """Option of a flag; `--no-realtime` belongs to `--realtime`."""
        flag = word.replace("_", "-")
        off = self.flags.get("--" + flag.removeprefix("--no-"))
        return self.flags.get(flag) or (off if off is not None and off.kind is bool else None)


def wrong_word(path: str, words: Sequence[str], actions: Mapping[str, Action]) -> str | None:
    """Say what is wrong with the first word that the command cannot use; None if every word can be used.

    Args:
        path: Name of the command.
        words: Words after the name.
        actions: All commands.
    """
    command = _command(path, actions)
    for word, option, values in _parts(command, words):
        if sentence := _wrong_part(word, option, values, command, actions):
            return f"{sentence} `exograv {path} --help` shows all options."
    return None


def missing_words(path: str, words: Sequence[str], actions: Mapping[str, Action], given: object = None) -> str | None:
    """Name the options that a command needs and that are absent; None if no option is missing.

    Args:
        path: Name of the command.
        words: Words after the name, all of which can be used.
        actions: All commands.
        given: Options of a settings file, if there is one.
    """
    command = _command(path, actions)
    present = {option.field for _, option, _ in _parts(command, words) if option is not None}
    defaults = {one.name: one.default for one in fields(command_class(actions[path])) if one.default_factory is MISSING}
    given_by = defaults if given is None else vars(given)
    needed = {name for name, value in given_by.items() if any(value is none for none in (MISSING, tyro.MISSING))}
    absent = [one for one in [*command.places, *command.flags.values()] if one.field in needed - present]
    if not absent:
        return None
    listed = "; ".join(f"{_name(one)} ({one.help.split('. ')[0].rstrip('.')})" for one in absent)
    return f"`exograv {path}` needs {listed}. `exograv {path} --help` shows all options."


def _parts(command: _Command, words: Sequence[str]) -> Iterator[tuple[str, Option | None, list[str]]]:
    """Split the words into flags with their values, and words in places; the option of an unknown word is None."""
    places, rest = list(command.places), list(words)
    while rest:
        word = rest.pop(0)
        name, equals, value = word.partition("=")
        if not _is_flag(word):
            option = next(iter(places), None)
            if option is not None and not _takes_several(option):
                places.pop(0)
            yield word, option, [word]
            continue
        option = command.option(name)
        values = [value] if equals else []
        if option is not None and option.kind is not bool and not equals:
            values = _following(option, rest)
        yield name, option, values


def _wrong_part(
    word: str, option: Option | None, values: list[str], command: _Command, actions: Mapping[str, Action]
) -> str | None:
    if option is None:
        if not _is_flag(word):
            takes = " ".join(map(_name, command.places)) or "no word without a flag"
            return f"'{word}' is one word too many: `exograv {command.path}` takes {takes}."
        return None if word in ("-h", "--help") else _unknown(word, command, actions)
    if option.kind is bool:
        return (
            f"{word} is '{values[0]}', but it takes no value: give {word} alone, or leave it out." if values else None
        )
    if not values and not _takes_several(option):
        return f"{option.flag} has no value; allowed: {_allowed(option)}"
    # An option with a reader of its own is refused by that reader, with its own sentence.
    kinds = [] if _reader(option) is not None else [_element(kind) for kind in _kinds(option)]
    wrong = [value for value in values if kinds and not any(_can_be(kind, value) for kind in kinds)]
    return f"{_name(option)} is '{wrong[0]}'; allowed: {_allowed(option)}" if wrong else None


def _command(path: str, actions: Mapping[str, Action]) -> _Command:
    options = options_of(command_class(actions[path]))
    places = [one for one in options if tyro.conf.Positional in one.marks]
    return _Command(path, {one.flag: one for one in options if one not in places}, places)


def _is_flag(word: str) -> bool:
    """Return True if a word names an option; a negative number is a value."""
    return word.startswith("--") or (word.startswith("-") and word[1:2].isalpha())


def _following(option: Option, rest: list[str]) -> list[str]:
    """Take the values of an option from the front of the words that follow its flag."""
    values = list[str]()
    while rest and not _is_flag(rest[0]) and (not values or _takes_several(option)):
        values.append(rest.pop(0))
    return values


def _takes_several(option: Option) -> bool:
    reader = _reader(option)
    if reader is not None:
        return reader.nargs == "*"
    return not option.is_repeatable and any(get_origin(kind) is tuple for kind in _kinds(option))


def _reader(option: Option) -> Any:
    return next((one for one in option.marks if isinstance(one, tyro.constructors.PrimitiveConstructorSpec)), None)


def _kinds(option: Option) -> tuple[Any, ...]:
    """Types that the value of an option may have, without None."""
    union = get_origin(option.kind) in (Union, types.UnionType)
    return tuple(kind for kind in (get_args(option.kind) if union else (option.kind,)) if kind is not type(None))


def _element(kind: Any) -> Any:
    return get_args(kind)[0] if get_origin(kind) is tuple else kind


def _can_be(kind: Any, text: str) -> bool:
    """Return True if a text is a value of a type."""
    if get_origin(kind) is Literal:
        return text in get_args(kind)
    if kind not in (int, float):
        return True
    with suppress(ValueError):
        kind(text)
        return True
    return False


def _allowed(option: Option) -> str:
    """Return the allowed values of an option, as the end of a sentence."""
    kind = _element(_kinds(option)[0])
    if get_origin(kind) is Literal:
        return f"{', '.join(map(str, get_args(kind)))}."
    within = next((mark for mark in option.marks if isinstance(mark, Within)), None)
    word = {int: "an integer", float: "a number"}.get(kind, "a path" if kind.__name__ == "Path" else "a word")
    return f"{word}, {within.range}" if within is not None and kind in (int, float) else f"{word}."


def _name(option: Option) -> str:
    if tyro.conf.Positional not in option.marks:
        return option.flag
    return option.field.upper().replace("_", "-")


def _unknown(name: str, command: _Command, actions: Mapping[str, Action]) -> str:
    if not name.startswith("--"):
        near = difflib.get_close_matches(f"-{name}", command.flags, n=1)
        meant = f"An option has two dashes: did you mean {near[0]}?" if near else "An option has two dashes."
        return f"`exograv {command.path}` has no option {name}. {meant}"
    flag = name.replace("_", "-")
    if flag == "--drives":
        from exograv.storage.machine_readiness import NEEDED, WITHOUT_DRIVES

        reason = WITHOUT_DRIVES.get(command.path, "it has no option --drives")
        return f"`exograv {command.path}` does not fly over drives: {reason}. These commands do: {', '.join(NEEDED)}."
    near = difflib.get_close_matches(flag, command.flags, n=1, cutoff=0.7)
    others = [other for other in actions if flag in _command(other, actions).flags]
    more = ""
    if others:
        listed = ", ".join(others[:4]) + (", …" if len(others) > 4 else "")
        more = f" These commands have it: {listed}."
    elif near:
        more = f" Did you mean {near[0]}?"
    return f"`exograv {command.path}` has no option {name}.{more}"
