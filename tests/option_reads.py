"""Search of the source for the options that a command reads.

The search starts at the function of a command and follows every name that its code refers to: functions, classes with
all their methods, and modules imported inside functions. An option counts as read if code that is reached takes it from
an object that holds the command's options: a parameter or an attribute whose annotation names an option class.
`asdict` does not count, because it only puts the options into a recording.
"""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from tests.syntax import nodes_of, syntax_tree

Code = ast.FunctionDef | ast.ClassDef


@dataclass
class Module:
    """Definitions and imports of a module."""

    name: str
    tree: ast.Module
    code: dict[str, ast.AST] = field(default_factory=dict)
    imports: dict[str, tuple[str, str]] = field(default_factory=dict)
    """Module and name in it, by local name; an empty name is the module itself."""


@cache
def module(name: str) -> Module | None:
    """Read a module of the package; None for a name that is no such module."""
    if not name.startswith(("exograv", "tests.")):
        return None
    try:
        spec = find_spec(name)
    except ModuleNotFoundError:
        return None
    if spec is None or spec.origin is None:
        return None
    path = Path(spec.origin)
    tree = syntax_tree(path)
    found = Module(name, tree)
    package = name if spec.submodule_search_locations is not None else name.rpartition(".")[0]
    for node in nodes_of(path):
        if isinstance(node, ast.ImportFrom):
            parts = package.split(".")
            above = ".".join(parts[: len(parts) - node.level + 1]) if node.level else ""
            origin = ".".join(filter(None, (above, node.module)))
            found.imports |= {one.asname or one.name: (origin, one.name) for one in node.names}
    for node in tree.body:
        if isinstance(node, Code):
            found.code[node.name] = node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found.code |= {one.id: node for one in targets if isinstance(one, ast.Name)}
    return found


@cache
def definition(name: str, local: str) -> tuple[str, ast.AST] | None:
    """Find the code that a name in a module stands for, through imports."""
    for _ in range(10):
        here = module(name)
        if here is None:
            return None
        if local in here.code:
            return name, here.code[local]
        if local not in here.imports:
            return None
        name, local = here.imports[local]
        if (inside := module(f"{name}.{local}")) is not None:
            return inside.name, inside.tree
    return None


@dataclass
class Facts:
    """Names that one function or class refers to, and what it does with them."""

    references: set[str] = field(default_factory=set)
    takes: set[tuple[str, str]] = field(default_factory=set)
    """Pairs of an owner's name and the attribute that is taken from it."""

    annotated: list[tuple[str, set[str]]] = field(default_factory=list)
    """Parameters and fields with the names in their annotations."""

    handed: set[tuple[str, str]] = field(default_factory=set)
    """Assignments of one name to another."""

    copied: set[tuple[str, str]] = field(default_factory=set)
    """Calls `Kind(**vars(name))`, as pairs of name and kind."""


FACTS: dict[int, Facts] = {}


def facts(node: ast.AST) -> Facts:
    """Collect the facts of one definition."""
    if id(node) not in FACTS:
        found = FACTS[id(node)] = Facts()
        for one in ast.walk(node):
            _note(one, found)
    return FACTS[id(node)]


def _note(one: ast.AST, found: Facts) -> None:
    if isinstance(one, ast.Name):
        found.references.add(one.id)
    elif isinstance(one, ast.Attribute):
        found.references.add(one.attr)
        found.takes.add((_last(one.value), one.attr))
    elif isinstance(one, ast.arg):
        found.annotated.append((one.arg, _words(one.annotation)))
    elif isinstance(one, ast.AnnAssign):
        found.annotated.append((_last(one.target), _words(one.annotation)))
    elif isinstance(one, ast.Assign):
        found.handed |= {(_last(value), _last(target)) for target, value in _pairs(one)}
    elif isinstance(one, ast.Call):
        for word in one.keywords:
            inner = word.value
            if word.arg is None and isinstance(inner, ast.Call) and _last(inner.func) == "vars":
                found.copied.add((_last(inner.args[0]), _last(one.func)))


def _last(node: ast.AST) -> str:
    return node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""


def _words(annotation: ast.AST | None) -> set[str]:
    return set() if annotation is None else set(re.findall(r"\w+", ast.unparse(annotation)))


def _pairs(node: ast.Assign) -> Iterator[tuple[ast.AST, ast.AST]]:
    for target in node.targets:
        if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
            yield from zip(target.elts, node.value.elts, strict=False)
        else:
            yield target, node.value


@cache
def reached(start: str, function: str) -> list[ast.AST]:
    """Return all code that a function refers to, directly or not."""
    first = definition(start, function)
    assert first is not None
    waiting, seen, found = [first], set[int](), list[ast.AST]()
    while waiting:
        name, node = waiting.pop()
        if id(node) in seen or isinstance(node, ast.Module):
            continue
        seen.add(id(node))
        found.append(node)
        for local in facts(node).references:
            # A function may import another function of its own name, so both are followed.
            origin = here.imports.get(local) if (here := module(name)) is not None else None
            both = (definition(name, local), None if origin is None else definition(*origin))
            waiting += filter(None, both)
    return found


@cache
def facts_reached(start: str, function: str) -> Facts:
    """Return the facts of all code that a function refers to, but not what is taken, which depends on the class."""
    found = Facts()
    for one in map(facts, reached(start, function)):
        found.annotated += one.annotated
        found.handed |= one.handed
        found.copied |= one.copied
    return found


def options_read(start: str, function: str, kind: type) -> set[str]:
    """Return the names that a command takes from the options of a class.

    Methods and properties of the class and its bases count if the command calls them, with what they take in turn.
    """
    code, all_facts = reached(start, function), facts_reached(start, function)
    kinds = {cls.__name__ for cls in kind.__mro__ if cls is not object}
    holders, taken = set[str](), set[str]()
    for _ in range(3):  # A copy of the options has a class of its own, with holders of its own.
        holders |= {name for name, words in all_facts.annotated if words & kinds}
        holders |= {name for origin, name in all_facts.handed if origin in holders}
        kinds |= {copy for name, copy in all_facts.copied if name in holders}
    own = [node for node in code if isinstance(node, ast.ClassDef) and node.name in kinds]
    for node in code:
        if node not in own:
            taken |= {name for owner, name in facts(node).takes if owner in holders}
    methods = [one for node in own for one in node.body if isinstance(one, ast.FunctionDef)]
    for _ in range(5):
        for method in methods:
            if method.name in taken:
                taken |= {name for owner, name in facts(method).takes if owner == "self"}
    return taken
