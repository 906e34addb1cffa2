"""No two folders of the package import each other, directly or indirectly; `__init__` belongs to its folder.

No module imports a `__main__`, so such a file cannot close a cycle and is left out.
"""

import ast
from collections.abc import Iterator
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

from tests.syntax import nodes_of

import exograv

PACKAGE = Path(exograv.__file__).parent
ROOT = PACKAGE.parent
MODULES = {
    path.relative_to(ROOT).with_suffix("").parts: path for path in PACKAGE.rglob("*.py") if path.stem != "__main__"
}

Name = tuple[str, ...]


def folder_of(module: Name) -> Name | None:
    """Folder of a module or package; None for a name that is neither."""
    if (*module, "__init__") in MODULES:
        return module
    return module[:-1] if module in MODULES else None


def imported(module: Name) -> Iterator[Name]:
    """Folders that a module imports from, at its top or later."""
    for node in nodes_of(MODULES[module]):
        if isinstance(node, ast.Import):
            found = [tuple(alias.name.split(".")) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            above = module[: -node.level] if node.level else ()
            source = (*above, *(node.module.split(".") if node.module else ()))
            found = [(*source, alias.name) if folder_of((*source, alias.name)) else source for alias in node.names]
        else:
            continue
        yield from (folder for name in found if (folder := folder_of(name)) is not None)


@cache
def import_graph() -> dict[Name, set[Name]]:
    """Return the folders that each folder imports from."""
    graph: dict[Name, set[Name]] = {}
    for module in MODULES:
        folder = module[:-1]
        graph.setdefault(folder, set()).update(set(imported(module)) - {folder})
    return graph


def cycle_in(graph: dict[Name, set[Name]]) -> list[str]:
    """Folders of one cycle, the first again at the end; empty if there is none."""
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        return [".".join(folder) for folder in error.args[1]]
    return []


def test_no_two_folders_import_each_other_directly_or_around():
    assert cycle_in(import_graph()) == []


def test_the_graph_holds_every_folder_and_leads_from_the_command_line_to_every_room():
    graph = import_graph()
    assert set(graph) == {path.parent.relative_to(ROOT).parts for path in PACKAGE.rglob("__init__.py")}
    rooms = {folder[1] for folder in graph if len(folder) > 1}
    assert rooms == {path.parent.name for path in PACKAGE.glob("*/__init__.py")}
    found, waiting = set[Name](), [folder for folder in graph if folder[:2] == ("exograv", "cli")]
    while waiting:
        if (folder := waiting.pop()) not in found:
            found.add(folder)
            waiting += graph[folder]
    assert {folder[1] for folder in found if len(folder) > 1} == rooms


def test_a_cycle_around_three_folders_is_found():
    assert cycle_in({("a",): {("b",)}, ("b",): {("c",)}, ("c",): {("a",)}}) != []
