"""From a command's function to its options: the classes in its signature are all that the command line reads."""

from collections.abc import Callable
from dataclasses import fields, make_dataclass
from functools import cache
from inspect import signature
from typing import Any

from exograv.results import json_value

from .base_options import Common

Action = Callable[..., Any]
"""Takes instances of its options' classes, and `Common` if it needs that; returns a result that has a JSON form."""


def option_classes(action: Action) -> dict[str, type]:
    """Class of each parameter of a command. Its result may have a class that is imported only when it runs."""
    return {name: parameter.annotation for name, parameter in signature(action).parameters.items()}


@cache
def command_class(action: Action) -> type[Common]:
    """All options of a command in one flat class, which tyro reads. Its instances are not checked."""
    kinds = tuple(kind for kind in option_classes(action).values() if kind is not Common)
    namespace = {"__doc__": action.__doc__, "__post_init__": lambda _: None}
    return make_dataclass(action.__name__, [], bases=(*kinds, Common), frozen=True, namespace=namespace)


def act(action: Action, parsed: Common) -> dict[str, Any]:
    """Run a command; return the object that `--json` writes.

    Raises:
        ConfigError: An option cannot be used.
    """
    parts = {
        name: kind(**{field.name: getattr(parsed, field.name) for field in fields(kind) if field.init})
        for name, kind in option_classes(action).items()
    }
    return json_value(action(**parts))
