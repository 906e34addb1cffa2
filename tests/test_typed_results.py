"""No public function, method or field that another room uses has `dict[str, Any]` in its signature."""

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from tests.syntax import nodes_of, syntax_tree

import exograv

PACKAGE = Path(exograv.__file__).parent
MODULES = {
    ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__"): path
    for path in PACKAGE.rglob("*.py")
}
UNTYPED = "dict[str, Any]"

EXCEPTIONS = frozenset({"results.JsonObject"})
"""Names with their own reason, stated in the docstring of the function or field."""

Symbol = tuple[str, str]
"""Module and name of a definition at its top."""

Definition = ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef | ast.Assign | ast.AnnAssign


@cache
def trees() -> dict[str, ast.Module]:
    """Syntax tree of each module."""
    return {name: syntax_tree(path) for name, path in MODULES.items()}


def room_of(module: str) -> str:
    """First folder or file below the package."""
    return f"{module}.".split(".")[1]


def imports_of(module: str) -> dict[str, Symbol]:
    """Source and name of everything that a module imports from the package, at its top or later."""
    found: dict[str, Symbol] = {}
    package = module.split(".") if MODULES[module].stem == "__init__" else module.split(".")[:-1]
    for node in nodes_of(MODULES[module]):
        if isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            source = ".".join((*above, *((node.module,) if node.module else ())))
            found |= {one.asname or one.name: (source, one.name) for one in node.names if source.startswith("exograv")}
    return found


def definitions_of(module: str) -> dict[str, Definition]:
    """Classes, functions and assignments at the top of a module."""
    found: dict[str, Definition] = {}
    for node in trees()[module].body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            found[node.name] = node
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found |= {target.id: node for target in targets if isinstance(target, ast.Name)}
    return found


@cache
def imports() -> dict[str, dict[str, Symbol]]:
    return {module: imports_of(module) for module in MODULES}


@cache
def definitions() -> dict[str, dict[str, Definition]]:
    return {module: definitions_of(module) for module in MODULES}


def resolved(module: str, name: str) -> Symbol | None:
    """Place where a name that a module uses is defined, through the modules that pass it on."""
    while name not in definitions().get(module, {}):
        if name not in imports().get(module, {}):
            return None
        module, name = imports()[module][name]
    return module, name


@cache
def attributes_by_room() -> dict[str, set[str]]:
    """Names that each room reads as an attribute of something."""
    found: dict[str, set[str]] = defaultdict(set)
    for module, path in MODULES.items():
        found[room_of(module)] |= {node.attr for node in nodes_of(path) if isinstance(node, ast.Attribute)}
    return found


def used_elsewhere() -> Iterator[tuple[Symbol, str]]:
    """List each definition with a room other than its own that imports it, or reads it from an imported module."""
    for module, imported in imports().items():
        for source, name in imported.values():
            if (symbol := resolved(source, name)) is not None:
                yield symbol, room_of(module)
            elif (inner := f"{source}.{name}") in definitions():
                yield from (
                    ((inner, one), room_of(module))
                    for one in attributes_by_room()[room_of(module)] & {*definitions()[inner]}
                )


def signature(node: ast.AST) -> str:
    """Types in the signature of a function, of a field or of an alias."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        return " ".join(ast.unparse(one) for one in [*(a.annotation for a in arguments), node.returns] if one)
    if isinstance(node, ast.AnnAssign):
        return ast.unparse(node.annotation)
    return ast.unparse(node.value) if isinstance(node, ast.Assign) and isinstance(node.value, ast.Subscript) else ""


def members(node: ast.ClassDef, room: str) -> Iterator[tuple[str, ast.AST]]:
    """Public fields and methods of a class whose names a room reads; the fields of instances among them."""
    for one in ast.walk(node):
        name = getattr(one, "name", None)
        if isinstance(one, ast.AnnAssign):
            name = one.target.attr if isinstance(one.target, ast.Attribute) else getattr(one.target, "id", None)
        is_own = one in node.body or (isinstance(one, ast.AnnAssign) and isinstance(one.target, ast.Attribute))
        if is_own and name and not name.startswith("_") and name in attributes_by_room()[room]:
            yield name, one


@cache
def untyped() -> dict[str, set[str]]:
    """Names with an untyped signature, each with the rooms that use it.

    Classes that a signature mentions are followed: another room holds instances of classes that it never imports.
    """
    found: dict[str, set[str]] = defaultdict(set)
    waiting, seen = list(used_elsewhere()), set[tuple[Symbol, str]]()
    while waiting:
        (module, name), room = use = waiting.pop()
        if use in seen:
            continue
        seen.add(use)
        node = definitions()[module][name]
        parts = [(f"{name}.{one}", part) for one, part in members(node, room)] if isinstance(node, ast.ClassDef) else []
        for label, part in parts or [(name, node)]:
            types = signature(part)
            if UNTYPED in types and room != room_of(module) and not name.startswith("_"):
                found[f"{module.removeprefix('exograv.')}.{label}"].add(room)
            symbols = [resolved(module, word) for word in set(re.findall(r"\w+", types))]
            waiting += [(symbol, room) for symbol in symbols if symbol is not None]
    return found


def test_no_untyped_object_crosses_a_room():
    assert {name: sorted(rooms) for name, rooms in untyped().items() if name not in EXCEPTIONS} == {}


def test_exceptions_are_still_needed():
    assert untyped().keys() >= EXCEPTIONS
