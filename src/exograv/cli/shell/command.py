"""Options of a command from its function: the command line reads only the classes in its signature."""

import ast
import inspect
import textwrap
from collections.abc import Callable
from contextvars import ContextVar
from dataclasses import dataclass, fields, make_dataclass
from functools import cache
from inspect import signature
from itertools import pairwise
from typing import Any, get_type_hints

import tyro

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


@dataclass(frozen=True)
class Option:
    """Option of a command."""

    field: str
    """Name of its field."""

    flag: str
    kind: Any
    """Type of the option's value, without its marks."""

    marks: tuple[Any, ...]
    owners: tuple[type, ...]
    """Classes that declare the field, the one in force first."""

    @property
    def key(self) -> str:
        """Name of the option in a settings file."""
        return self.flag.removeprefix("--")

    @property
    def is_repeatable(self) -> bool:
        """True if each use of the flag adds one value."""
        return tyro.conf.UseAppendAction in self.marks

    @property
    def help(self) -> str:
        """Help text of the option: its `help` mark, or else the docstring of its field."""
        texts = [mark.help for mark in self.marks if getattr(mark, "help", None)]
        return texts[-1] if texts else next(filter(None, (_documented(one, self.field) for one in self.owners)), "")


def options_of(kind: type) -> list[Option]:
    """Return all options of a command that can be given."""
    hints, marked = get_type_hints(kind), {field: (flag, marks) for field, flag, marks in flags(kind)}
    found = list[Option]()
    for one in fields(kind):
        flag, marks = marked.get(one.name, (f"--{one.name.replace('_', '-')}", ()))
        if tyro.conf.Fixed not in marks:
            owners = tuple(cls for cls in kind.__mro__ if one.name in inspect.get_annotations(cls))
            found.append(Option(one.name, flag, hints[one.name], marks, owners))
    return found


def _documented(kind: type, field: str) -> str:
    """Return the docstring of a field, from the source of its class."""
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0]
    assert isinstance(body, ast.ClassDef)
    for line, after in pairwise(body.body):
        is_field = isinstance(line, ast.AnnAssign) and isinstance(line.target, ast.Name) and line.target.id == field
        if is_field and isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant):
            return " ".join(str(after.value.value).split())
    return ""


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


def checked_parts(action: Action, parsed: Common) -> dict[str, Any]:
    """Return the arguments of a command's function, with every option checked.

    Raises:
        ConfigError: An option cannot be used.
    """
    refuse_idle(parsed)
    return {
        name: kind(**{field.name: getattr(parsed, field.name) for field in fields(kind) if field.init})
        for name, kind in option_classes(action).items()
    }


def act(action: Action, parsed: Common) -> dict[str, Any]:
    """Run a command; return the object that `--json` writes.

    Raises:
        ConfigError: An option cannot be used.
    """
    return json_value(action(**checked_parts(action, parsed)))
