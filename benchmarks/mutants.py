"""Mutation test of safety/: one line at a time is made wrong, and the tests must fail.

    nice -n 10 python benchmarks/mutants.py                          # all, one after the other, about an hour
    nice -n 10 python benchmarks/mutants.py --sample 100 --seed 1    # some
    python benchmarks/mutants.py --branches                          # conditions that no test has seen both ways

The working tree is never touched: a process is forked for every mutant and imports it in place of the module. Results
are noted in a file and not repeated: a killed mutant until its module changes, a survivor until the tests change.
"""

import argparse
import ast
import builtins
import copy
import hashlib
import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import random
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["EXOGRAV_GUARD"] = "source"  # a mutant is Python; the compiled guard would not notice it

import hypothesis
import hypothesis.extra.numpy
import numpy  # noqa: F401 - imported once for all children
import pytest

import exograv.errors
import exograv.signals  # noqa: F401 - no module of the room
from wrong_lines import changes, visited

ROOT = Path(__file__).parents[1]
ROOM, TESTS = ROOT / "src" / "exograv" / "safety", ROOT / "tests" / "safety"
ALONE, FIGURES = "test_modes.py", "test_figures.py"
LONGEST_S = 240
"""Time limit of the tests; tests that do not end count as a killed mutant."""


@dataclass(frozen=True)
class Mutant:
    """Wrong module, described by its place; the tree is made on demand."""

    path: Path
    source: str
    name: str
    node: int
    change: int

    def tree(self) -> ast.Module:
        """Return the module with one thing wrong."""
        tree = ast.parse(self.source)
        place = next(islice(visited(tree), self.node, None))
        next(islice(changes(place), self.change, None))[1]()
        return ast.fix_missing_locations(tree)


def modules() -> list[Path]:
    """List the files of the guard. The others in `native/` run before a session."""
    return [*sorted(ROOM.glob("*.py")), ROOM / "native" / "core.py"]


def name_of(path: Path) -> str:
    """Return the name by which a module is imported."""
    return ".".join(["exograv.safety", *path.relative_to(ROOM).with_suffix("").parts])


def mutants() -> Iterator[Mutant]:
    """Yield the mutants of the whole room."""
    for path in modules():
        source = path.read_text(encoding="utf-8")
        for i, node in enumerate(visited(ast.parse(source))):
            where = f"{path.name}:{getattr(node, 'lineno', 0)}:{getattr(node, 'col_offset', 0)}"
            for j, (what, _) in enumerate(changes(node)):
                yield Mutant(path, source, f"{where} {what}", i, j)


class Instead(importlib.abc.MetaPathFinder):
    """Import hook that puts trees in place of modules of the room."""

    def __init__(self, trees: dict[str, ast.Module]):
        self.trees = trees

    def find_spec(self, name: str, path: Any = None, target: Any = None):
        """Return the specification of a module that is replaced, else None."""
        if name not in self.trees:
            return None
        file = str(ROOM.joinpath(*name.split(".")[2:]).with_suffix(".py"))
        return importlib.util.spec_from_loader(name, Loader(name, file, self.trees[name]), origin=file)


class Loader(importlib.machinery.SourceFileLoader):
    """Loader of a tree."""

    def __init__(self, name: str, file: str, tree: ast.Module):
        super().__init__(name, file)
        self.tree = tree

    def get_code(self, fullname: str) -> Any:
        """Compile the tree; never cache it."""
        return compile(self.tree, self.path, "exec")


def run_tests(trees: dict[str, ast.Module], first: str, at_end: Callable[[], None] = lambda: None) -> int:
    """Run the tests in a process of their own; return pytest's exit code, or 9 if they do not end."""
    child = os.fork()
    if child == 0:
        code = 1
        try:
            code = _tests_here(trees, first)
            at_end()
        finally:
            # `_exit` closes nothing that the parent has opened.
            os._exit(code)
    status = os.waitpid(child, 0)[1]
    return os.waitstatus_to_exitcode(status) if os.WIFEXITED(status) else 9


def _tests_here(trees: dict[str, ast.Module], first: str) -> int:
    signal.alarm(LONGEST_S)
    if "MUTANTS_ALOUD" not in os.environ:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)
    sys.meta_path.insert(0, Instead(trees))
    # The comparison with the compiled guard would find every changed constant, and prove nothing.
    files = [file for file in TESTS.glob("test_*.py") if file.name != "test_native.py"]
    # The modes are tested alone: no other module imports them.
    if f"test_{first}" == ALONE:
        files = [TESTS / ALONE, TESTS / FIGURES]
    elif first:
        files.remove(TESTS / ALONE)
    files.sort(key=lambda file: (file.name != f"test_{first}", "second" not in file.name, file.name))
    options = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "--assert=plain", "--hypothesis-profile=mutants"]
    options += ["-o", "addopts=--import-mode=importlib", "--rootdir", str(ROOT)]
    return int(pytest.main([*options, *map(str, files)]))


def prepare() -> None:
    """Set the folder and the Hypothesis profile for all children."""
    os.chdir(ROOT)
    # No shrinking: the fact that a test fails is enough.
    phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
    hypothesis.settings.register_profile("mutants", deadline=None, derandomize=True, phases=phases, database=None)


def digest(*texts: str) -> str:
    """Return a short hash of some texts."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def hunt(options: argparse.Namespace) -> None:
    """Try the mutants; print survivors and the share that was killed."""
    tests = digest(*(file.read_text(encoding="utf-8") for file in sorted(TESTS.glob("*.py"))))
    known: dict[str, dict] = {}
    if options.log.is_file():
        for line in options.log.read_text(encoding="utf-8").splitlines():
            entry = json.loads(line)
            known[entry["key"]] = entry
    found = [one for one in mutants() if options.only in one.path.name]
    if options.sample:
        found = random.Random(options.seed).sample(found, min(options.sample, len(found)))
    if run_tests({}, "") != 0:
        sys.exit("The tests fail on the unchanged source. Correct them first: a mutant would prove nothing.")
    killed = 0
    for one in found:
        key = digest(one.name, one.source)
        entry = known.get(key)
        if entry is None or (not entry["killed"] and entry["tests"] != tests):
            code = run_tests({name_of(one.path): one.tree()}, one.path.name)
            entry = {"key": key, "killed": code != 0, "tests": tests, "name": one.name, "code": code}
            with options.log.open("a", encoding="utf-8") as log:
                log.write(json.dumps(entry) + "\n")
        killed += entry["killed"]
        if not entry["killed"]:
            print(f"survived: {one.name}", flush=True)
    print(f"{killed} of {len(found)} killed, {100.0 * killed / max(len(found), 1):.1f} %")


class Watched(ast.NodeTransformer):
    """Transformer that notes outcomes of conditions, of each operand of and/or but the last, and function calls."""

    def __init__(self, file: str):
        self.file = file
        self.expected: dict[str, tuple[bool, ...]] = {}

    def _note(self, node: ast.expr, outcomes: tuple[bool, ...] = (True, False), name: str = "") -> ast.expr:
        name = f"{self.file}:{node.lineno}:{node.col_offset} {(name or ast.unparse(node))[:70]}"
        self.expected[name] = outcomes
        return ast.Call(ast.Name("__noted__", ast.Load()), [ast.Constant(name), node], [])

    def visit_If(self, node: ast.If | ast.IfExp | ast.While) -> ast.AST:
        """Watch the condition of a statement or an expression."""
        whole = copy.deepcopy(node.test)
        self.generic_visit(node)
        node.test = self._note(node.test, name=ast.unparse(whole))
        return node

    visit_IfExp = visit_While = visit_If

    def visit_BoolOp(self, node: ast.BoolOp) -> ast.AST:
        """Watch each operand but the last: it decides if the next ones are evaluated."""
        names = [ast.unparse(value) for value in node.values]
        self.generic_visit(node)
        *asked, last = node.values
        node.values = [*(self._note(value, name=name) for value, name in zip(asked, names, strict=False)), last]
        return node

    def visit_comprehension(self, node: ast.comprehension) -> ast.AST:
        """Watch the filters."""
        self.generic_visit(node)
        node.ifs = [self._note(one) for one in node.ifs]
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.AST:
        """Watch that the function is called."""
        self.generic_visit(node)
        called = self._note(ast.copy_location(ast.Constant(node.name), node), (True,))
        node.body.insert(0, ast.Expr(called))
        return node


def watch() -> None:
    """Print the conditions that no test has seen both ways."""
    seen: set[tuple[str, bool]] = set()
    expected: dict[str, tuple[bool, ...]] = {}
    trees = {}
    for path in modules():
        watched = Watched(path.name)
        tree = watched.visit(ast.parse(path.read_text(encoding="utf-8")))
        trees[name_of(path)] = ast.fix_missing_locations(tree)
        expected.update(watched.expected)

    def noted(name: str, value: Any) -> Any:
        seen.add((name, bool(value)))
        return value

    builtins.__dict__["__noted__"] = noted
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "seen.json"

        def save() -> None:
            file.write_text(json.dumps(sorted(seen)), encoding="utf-8")

        code = run_tests(trees, "", save)
        found = {(name, value) for name, value in json.loads(file.read_text(encoding="utf-8"))}
    wanted = [(name, value) for name, values in expected.items() for value in values]
    missed = [one for one in wanted if one not in found]
    for name, value in missed:
        print(f"never {value}: {name}")
    print(f"{len(wanted) - len(missed)} of {len(wanted)} outcomes seen; tests ended with {code}")


def main() -> None:
    """Run the mutants, or watch the branches."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", type=int, default=0, help="number of mutants, drawn at random; 0 for all")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", default="", help="part of the name of a file")
    parser.add_argument("--log", type=Path, default=Path(tempfile.gettempdir()) / "exograv_mutants.jsonl")
    parser.add_argument("--branches", action="store_true")
    parser.add_argument("--count", action="store_true", help="only print the number of mutants")
    options = parser.parse_args()
    prepare()
    if options.count:
        for name, count in Counter(one.path.name for one in mutants()).items():
            print(name, count)
    elif options.branches:
        watch()
    else:
        hunt(options)


if __name__ == "__main__":
    main()
