"""Mutants of a room, each a module with one thing wrong, and the table of those that no test can find."""

import ast
import functools
import hashlib
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from wrong_lines import UNTOUCHED, changes, visited

ROOT = Path(__file__).parents[1]
SOURCE = ROOT / "src" / "exograv"
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.toml")


def digest(*texts: str) -> str:
    """Return a short hash of some texts."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class Room:
    """Modules that are made wrong, and the tests that must notice it."""

    modules: tuple[Path, ...]
    folders: tuple[Path, ...]
    """Folders of the tests."""
    passed_over: tuple[str, ...] = ()
    """Test modules that do not run."""
    starts_processes: bool = False
    """True if tests start interpreters, in which the module has to be wrong, too."""

    @property
    def tests(self) -> list[Path]:
        """Modules of the tests, sorted."""
        found = [file for folder in self.folders for file in sorted(folder.glob("test_*.py"))]
        return [file for file in found if file.name not in self.passed_over]

    @property
    def files(self) -> list[Path]:
        """Modules of the tests with their helpers, sorted."""
        return [file for folder in self.folders for file in sorted(folder.glob("*.py"))]


def _room_of_runtime() -> Room:
    names, tests = ("control_loop", "processes"), ROOT / "tests" / "runtime"
    modules = [file for name in names for file in sorted((SOURCE / "runtime" / name).glob("*.py"))]
    return Room(tuple(modules), tuple(tests / name for name in names), starts_processes=True)


ROOMS = {
    # The other files in `native/` run before a session. The comparison with the compiled guard would find every changed
    # constant, and prove nothing.
    "safety": Room(
        (*sorted((SOURCE / "safety").glob("*.py")), SOURCE / "safety" / "native" / "core.py"),
        (ROOT / "tests" / "safety",),
        ("test_native.py",),
    ),
    "runtime": _room_of_runtime(),
}
"""Guard; and its process's mailboxes, lines and commands."""


@dataclass(frozen=True)
class Mutant:
    """Wrong module, described by its place; the tree is made on demand."""

    path: Path
    source: str
    name: str
    node: int
    change: int
    function: str
    """Qualified name of the function that is changed; empty outside of functions."""

    def tree(self) -> ast.Module:
        """Return the module with one thing wrong."""
        tree = ast.parse(self.source)
        place = next(islice(visited(tree), self.node, None))
        next(islice(changes(place), self.change, None))[1]()
        return ast.fix_missing_locations(tree)

    def lines(self) -> tuple[str, str]:
        """Return the changed line before and after the change, without comments and in one line."""
        first, before = next(one for one in reversed(_statements(self.source)) if one[0] <= self.node)
        changed = ast.parse("\n".join(before)).body[0]  # Faster than a deep copy of the statement.
        place = next(islice(visited(changed), self.node - first, None))
        next(islice(changes(place), self.change, None))[1]()
        pairs = zip(before, ast.unparse(changed).splitlines(), strict=True)
        return next((was.strip(), becomes.strip()) for was, becomes in pairs if was != becomes)

    @property
    def key(self) -> str:
        """Short hash of the mutant and its module."""
        return digest(self.name, self.source)


@functools.lru_cache(maxsize=64)
def _statements(source: str) -> list[tuple[int, list[str]]]:
    """Statements of a module, each with the number of its first node in `visited` and its lines."""
    found, first = [], 1
    for one in ast.parse(source).body:
        found.append((first, ast.unparse(one).splitlines()))
        first += 0 if isinstance(one, UNTOUCHED) else len(list(visited(one)))
    return found


def name_of(path: Path) -> str:
    """Return the name by which a module is imported."""
    parts = path.relative_to(SOURCE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def mutants(room: Room) -> Iterator[Mutant]:
    """Yield the mutants of the whole room."""
    for path in room.modules:
        source = path.read_text(encoding="utf-8")
        tree = ast.parse(source)
        functions = dict(_functions(tree, "", ""))
        for i, node in enumerate(visited(tree)):
            where = f"{path.name}:{getattr(node, 'lineno', 0)}:{getattr(node, 'col_offset', 0)}"
            for j, (what, _) in enumerate(changes(node)):
                yield Mutant(path, source, f"{where} {what}", i, j, functions.get(node, ""))


def _functions(node: ast.AST, prefix: str, function: str) -> Iterator[tuple[ast.AST, str]]:
    """Yield each node with the outermost function in whose body it is; a default value is not in the body."""
    for child in ast.iter_child_nodes(node):
        inner = function
        if isinstance(node, ast.FunctionDef) and not function and child in node.body:
            inner = prefix
        if isinstance(child, ast.FunctionDef) and not inner:
            yield child, f"{prefix}.{child.name}".lstrip(".")
            yield from _functions(child, f"{prefix}.{child.name}".lstrip("."), "")
        elif isinstance(child, ast.ClassDef) and not inner:
            yield from _functions(child, f"{prefix}.{child.name}".lstrip("."), "")
        else:
            yield child, inner
            yield from _functions(child, prefix, inner)


@dataclass(frozen=True)
class Equivalent:
    """Changes of a line that no test can find."""

    file: str
    function: str
    was: str
    becomes: tuple[str, ...]
    reason: str
    places: int = 1
    """Number of equal lines in the function."""


def equivalents() -> list[Equivalent]:
    """Read the table of equivalent mutants of all rooms."""
    table = tomllib.loads(EQUIVALENT.read_text(encoding="utf-8"))
    rows = [{**row, "becomes": tuple(row["becomes"])} for row in table.get("equivalent", [])]
    return [Equivalent(**row) for row in rows]


def find_equivalents(found: list[Mutant], rows: list[Equivalent]) -> tuple[set[Mutant], list[str]]:
    """Return the mutants in the table, and the changes in the table that are no mutants of the stated places."""
    wanted = {(row.file, row.function, row.was, becomes): row.places for row in rows for becomes in row.becomes}
    places, matching = {place[:2] for place in wanted}, dict[tuple[str, ...], list[Mutant]]()
    for one in found:
        if (one.path.name, one.function) in places:
            matching.setdefault((one.path.name, one.function, *one.lines()), []).append(one)
    counts = {place: len(matching.get(place, [])) for place in wanted}
    wrong = [f"{counts[place]} mutants: {' | '.join(place)}" for place, many in wanted.items() if counts[place] != many]
    return {one for place in wanted for one in matching.get(place, [])}, wrong
