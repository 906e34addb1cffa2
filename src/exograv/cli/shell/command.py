"""Options of a command from its function: the command line reads only the classes in its signature."""

from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import fields, make_dataclass
from functools import cache
from inspect import signature
from typing import Any

from exograv.options import Acts, flags
from exograv.results import json_value

from .base_options import Common
from .spellings import MACHINE

Action = Callable[..., Any]
"""Function of a command. It takes its option classes, and `Common` if needed. Its result has a JSON form."""


estimate: ContextVar[str] = ContextVar("estimate", default="")
"""Usual duration of the running command, as a sentence; empty if it is short or not known."""


def option_classes(action: Action) -> dict[str, type]:
    """Return option classes by parameter. The return type stays unresolved: its module is imported only at run time."""
    return {name: parameter.annotation for name, parameter in signature(action).parameters.items()}


@cache
def command_class(action: Action) -> type[Common]:
    """Build one flat class of all options of a command, which tyro reads. Its instances are not checked."""
    classes = option_classes(action).values()
    shared = next((kind for kind in classes if issubclass(kind, Common)), Common)
    kinds = tuple(kind for kind in classes if not issubclass(kind, Common))
    namespace = {"__doc__": action.__doc__, "__post_init__": lambda _: None}
    return make_dataclass(action.__name__, [], bases=(*kinds, shared), frozen=True, namespace=namespace)


def refuse_idle(command: Common) -> None:
    """Check that every option that was given has an effect together with the other options.

    Raises:
        ConfigError: An option differs from its default, but has no effect.
    """
    defaults = {field.name: field.default for field in fields(command)}
    for field, flag, marks in flags(type(command)):
        value = getattr(command, field)
        for mark in marks:
            if isinstance(mark, Acts) and value != defaults[field]:
                mark.refuse("RIG" if field == MACHINE else flag, value, command)


def act(action: Action, parsed: Common) -> dict[str, Any]:
    """Run a command; return the object that `--json` writes.

    Raises:
        ConfigError: An option cannot be used.
    """
    refuse_idle(parsed)
    parts = {
        name: kind(**{field.name: getattr(parsed, field.name) for field in fields(kind) if field.init})
        for name, kind in option_classes(action).items()
    }
    return json_value(action(**parts))
