"""Pages of settings files: every key with its type, default and meaning, from the classes that check the files."""

import ast
import inspect
import itertools
import textwrap
from collections.abc import Iterator
from dataclasses import MISSING, dataclass, fields, is_dataclass
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel

LIMITS = {
    "ge": "≥ {}",
    "gt": "> {}",
    "le": "≤ {}",
    "lt": "< {}",
    "min_length": "length ≥ {}",
    "max_length": "length ≤ {}",
}
"""Words for the limits of a value, by their name in pydantic."""


@dataclass(frozen=True)
class SettingsFile:
    """File that a person writes, with the class that checks it."""

    name: str
    content: dict[type, str]
    """Path "" of the class of the whole file, and paths of classes that its types do not name."""

    purpose: str
    """Sentence with a link to the page that explains the file."""


def settings_page(files: tuple[SettingsFile, ...]) -> str:
    """Sections of the files, with a table of keys for each of their tables."""
    parts = [
        "# Settings files",
        "Keys of every file that a person writes, made from the classes that check them. Unknown keys are refused. A "
        "key without a default is required; a dash: it may be absent. The unit stands in the name of the key.",
    ]
    for file in files:
        parts += [f"## {file.name}", file.purpose]
        for kind, path in tables_of(file.content).items():
            head = [f"### {file.name}: `{path}`", documentation(kind)] if path else []
            parts += [*head, table_of(kind)]
    return "\n\n".join(parts) + "\n"


def tables_of(content: dict[type, str]) -> dict[type, str]:
    """Classes of a file and of all its tables, each with the path at which it first stands, outer ones first."""
    found, open_ones = dict(content), list(content)
    for outer in open_ones:
        for name, annotation in annotations_of(outer).items():
            for inner in settings_in(annotation):
                if inner not in found:
                    found[inner] = f"{found[outer]}.{name}".removeprefix(".")
                    open_ones.append(inner)
    return found


def settings_in(annotation: Any) -> Iterator[type]:
    """Classes of settings within a type, such as the entry of a list."""
    if isinstance(annotation, type) and (issubclass(annotation, BaseModel) or is_dataclass(annotation)):
        yield annotation
    for argument in get_args(annotation):
        yield from settings_in(argument)


def annotations_of(kind: type) -> dict[str, Any]:
    """Types of the keys of a table, with their limits."""
    if issubclass(kind, BaseModel):
        return {name: Annotated[one.annotation, None, *one.metadata] for name, one in kind.model_fields.items()}
    hints = get_type_hints(kind, include_extras=True)
    return {one.name: hints[one.name] for one in fields(kind)}


def table_of(kind: type) -> str:
    """Table of the keys of one class."""
    meanings = meanings_of(kind)
    rows = ["| key | type | default | meaning |", "|---|---|---|---|"]
    for name, annotation in annotations_of(kind).items():
        meaning = meanings.get(name) or " ".join(first_line(inner) for inner in settings_in(annotation))
        cells = (f"`{name}`", type_name(annotation), default_of(kind, name), meaning)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows)


def type_name(annotation: Any) -> str:
    """Type of a key in words, with its limits."""
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        limits = [words.format(f"{value:g}") for metadata in arguments[1:] for words, value in limits_in(metadata)]
        return ", ".join([type_name(arguments[0]), *limits])
    if origin is Literal:
        return ", ".join(f"`{value}`" for value in arguments)
    if origin in (Union, UnionType):
        return " or ".join(type_name(one) for one in arguments if one is not type(None))
    if origin in (list, tuple):
        return f"list of {type_name(arguments[0])}"
    if origin is dict:
        return f"table of {type_name(arguments[1])} by {type_name(arguments[0])}"
    return {str: "text", float: "number", int: "integer", bool: "true or false", Any: "any"}.get(annotation, "table")


def limits_in(metadata: Any) -> Iterator[tuple[str, float]]:
    """Words and value of each limit in the metadata of a type."""
    for part in (metadata, *getattr(metadata, "metadata", ())):
        for name, words in LIMITS.items():
            if (value := getattr(part, name, None)) is not None:
                yield words, value


def default_of(kind: type, name: str) -> str:
    """Default of a key; empty if the key is required, "–" if it may be absent."""
    if issubclass(kind, BaseModel):
        if kind.model_fields[name].is_required():
            return ""
        default = kind.model_fields[name].get_default(call_default_factory=True)
    else:
        default = next(one.default for one in fields(kind) if one.name == name)
        if default is MISSING:
            return ""
    if isinstance(default, BaseModel) or default in (None, [], (), {}, ""):
        return "–"
    return f"`{str(default).lower() if isinstance(default, bool) else default}`"


def meanings_of(kind: type) -> dict[str, str]:
    """Descriptions of the keys of a class, each as one line: docstring of the field, or its description."""
    body = ast.parse(textwrap.dedent(inspect.getsource(kind))).body[0].body  # pyright: ignore[reportAttributeAccessIssue]
    models = kind.model_fields if issubclass(kind, BaseModel) else {}
    found = {name: one.description for name, one in models.items() if one.description is not None}
    for field, text in itertools.pairwise(body):
        match field, text:
            case ast.AnnAssign(target=ast.Name(id=name)), ast.Expr(value=ast.Constant(value=str(meaning))):
                found[name] = " ".join(inspect.cleandoc(meaning).split())
            case _:
                pass
    return found


def first_line(kind: type) -> str:
    """First line of the docstring of a class."""
    return documentation(kind).partition("\n")[0]


def documentation(kind: type) -> str:
    """Docstring of a class."""
    return inspect.cleandoc(kind.__doc__ or "")
