"""Mutation test of safety/: one line at a time is made wrong, and the tests must fail.

    nice -n 10 python benchmarks/mutants.py                          # all
    nice -n 10 python benchmarks/mutants.py --only core --workers 2  # one file, two mutants at a time
    nice -n 10 python benchmarks/mutants.py --sample 100 --seed 1    # some
    python benchmarks/mutants.py --branches                          # conditions that no test has seen both ways

The working tree is never touched: a process is forked for every mutant. A change inside a function that did not run
while the tests were imported replaces the code of that function. All other changes import the changed module.

The tests that killed the last mutants in the least time run first, and the first failure ends a run. Results are noted
in a file and not repeated: of a killed mutant until its module or the test that killed it changes, of a survivor until
any test changes. `equivalent_mutants.toml` lists changes that no test can find, each with the reason; `--equivalent`
tries them too, and a killed one is an error.
"""

import argparse
import ast
import builtins
import copy
import functools
import gc
import hashlib
import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import random
import resource
import sys
import tempfile
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from types import CodeType, FrameType, FunctionType
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ["EXOGRAV_GUARD"] = "source"  # a mutant is Python; the compiled guard would not notice it

import hypothesis
import hypothesis.extra.numpy
import numpy  # noqa: F401 - imported once for all children
import pytest

import exograv.errors
import exograv.signals  # noqa: F401 - no module of the room
from wrong_lines import UNTOUCHED, changes, visited

ROOT = Path(__file__).parents[1]
ROOM, TESTS = ROOT / "src" / "exograv" / "safety", ROOT / "tests" / "safety"
EQUIVALENT = Path(__file__).with_name("equivalent_mutants.toml")
ALONE, FIGURES = "test_modes.py", "test_figures.py"
TIMES_AS_LONG, LONGER_S = 3.0, 20.0
"""Processor time of a mutant, as a multiple of the tests' own and beyond it [s]; a mutant that needs more is killed."""
FORGET, PRIOR_KILLS = 0.9, 0.05
"""Share of a test's earlier kills that counts after the next one, and kills of a test that has none."""

NOT_FOUND = 77
"""Exit code of a run that has found no function to change; such a mutant is imported."""

Place = tuple[str, int]
"""Qualified name of a function, and its first line."""


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
        first, before, statement = next(one for one in reversed(_statements(self.source)) if one[0] <= self.node)
        changed = copy.deepcopy(statement)
        place = next(islice(visited(changed), self.node - first, None))
        next(islice(changes(place), self.change, None))[1]()
        pairs = zip(before, ast.unparse(changed).splitlines(), strict=True)
        return next((was.strip(), becomes.strip()) for was, becomes in pairs if was != becomes)

    @property
    def key(self) -> str:
        """Short hash of the mutant and its module."""
        return digest(self.name, self.source)


@functools.lru_cache(maxsize=64)
def _statements(source: str) -> list[tuple[int, list[str], ast.stmt]]:
    """Statements of a module, each with the number of its first node in `visited` and its lines."""
    found, first = [], 1
    for one in ast.parse(source).body:
        found.append((first, ast.unparse(one).splitlines(), one))
        first += 0 if isinstance(one, UNTOUCHED) else len(list(visited(one)))
    return found


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


class Order:
    """Order of the tests: kills of the last mutants, per second that a test takes."""

    def __init__(self, seconds: dict[str, float]):
        self.seconds, self.kills = seconds, dict.fromkeys(seconds, 0.0)

    def note(self, killer: str) -> None:
        """Count a kill; earlier ones count less from now on."""
        self.kills = {test: FORGET * kills for test, kills in self.kills.items()}
        self.kills[killer] = self.kills.get(killer, 0.0) + 1.0

    def put(self, items: list[pytest.Item], module: str) -> list[pytest.Item]:
        """Return the tests for a module in this order; the modes are tested alone: no other module imports them."""
        if f"test_{module}" == ALONE:
            items = [one for one in items if one.path.name in (ALONE, FIGURES)]
        elif module:
            items = [one for one in items if one.path.name != ALONE]
        return sorted(items, key=self._urgency, reverse=True)

    def _urgency(self, item: pytest.Item) -> float:
        return (self.kills.get(item.nodeid, 0.0) + PRIOR_KILLS) / (self.seconds.get(item.nodeid, 0.0) + 0.005)


class Run:
    """Plugin that orders the tests of one run and notes processor time and the first failure."""

    def __init__(self, order: Order, module: str):
        self.order, self.module, self.killer = order, module, ""
        self.seconds: dict[str, float] = {}

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Put the tests in order."""
        items[:] = self.order.put(items, self.module)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """Measure the processor time of a test."""
        began = time.process_time()
        done = yield
        self.seconds[item.nodeid] = time.process_time() - began
        return done

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Note the first failure."""
        if report.failed and not self.killer:
            self.killer = report.nodeid


class Prepared:
    """Plugin that collects the tests, and gives them to `work` instead of running them."""

    def __init__(self, work: Callable[[list[pytest.Item], Run], None], run: Run):
        self.work, self.run = work, run

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Work with the tests."""
        self.work(session.items, self.run)
        return True


Result = tuple[int, str, dict[str, float]]
"""Exit code (9 for a run that did not end), first test that failed, and processor time of the tests [s]."""


class Child:
    """Run in a process of its own."""

    def __init__(self, run: Callable[[], Result], limit_s: float):
        self.file = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115 - closed when the result is read
        self.pid = os.fork()
        if self.pid == 0:
            code = 1
            try:
                resource.setrlimit(resource.RLIMIT_CPU, (round(limit_s), round(limit_s)))
                code, *noted = run()
                json.dump(noted, self.file)
                self.file.flush()
            finally:
                # `_exit` closes nothing that the parent has opened.
                os._exit(code)

    def result(self, status: int) -> Result:
        """Return the result of the process that has ended."""
        code = os.waitstatus_to_exitcode(status) if os.WIFEXITED(status) else 9
        with self.file as file:
            file.seek(0)
            text = file.read()
        killer, seconds = json.loads(text) if text else ("", {})
        return code, killer, seconds


def side_by_side(
    jobs: list[Any], run: Callable[[Any], Result], workers: int, limit_s: float
) -> Iterator[tuple[Any, Result]]:
    """Run jobs in processes of their own, some at a time, and yield each with its result."""
    waiting, at_work = list(reversed(jobs)), dict[int, tuple[Any, Child]]()
    while waiting or at_work:
        while waiting and len(at_work) < workers:
            job = waiting.pop()
            child = Child(lambda job=job: run(job), limit_s)
            at_work[child.pid] = job, child
        pid, status = os.wait()
        if pid in at_work:
            job, child = at_work.pop(pid)
            yield job, child.result(status)


def test_files() -> list[Path]:
    """List the tests. The comparison with the compiled guard would find every changed constant, and prove nothing."""
    return sorted(file for file in TESTS.glob("test_*.py") if file.name != "test_native.py")


def be_quiet() -> None:
    """Send all output of this process to nowhere."""
    if "MUTANTS_ALOUD" not in os.environ:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)


def run_pytest(*plugins: object) -> int:
    """Run the tests in this process and return pytest's exit code."""
    options = ["-x", "-q", "-s", "-p", "no:cacheprovider", "-p", "no:xdist", "--assert=plain"]
    options += ["--hypothesis-profile=mutants", "-o", "addopts=--import-mode=importlib", "--rootdir", str(ROOT)]
    return int(pytest.main([*options, *map(str, test_files())], [*plugins]))


def run_imported(trees: dict[str, ast.Module], order: Order, module: str = "") -> Result:
    """Run the tests, which import trees in place of modules."""
    be_quiet()
    sys.meta_path.insert(0, Instead(trees))
    run = Run(order, module)
    code = run_pytest(run)
    return code, run.killer, run.seconds


def run_collected(items: list[pytest.Item], run: Run, functions: list[FunctionType], mutant: Mutant) -> Result:
    """Run tests that are imported already, with another code in place of the one of a function."""
    codes = dict(_codes(compile(mutant.tree(), str(mutant.path), "exec")))
    changed = [one for one in functions if one.__module__ == name_of(mutant.path) and place_of(one.__code__) in codes]
    if mutant.function not in {one.__code__.co_qualname for one in changed}:
        return NOT_FOUND, "", {}
    for one in changed:
        one.__code__ = codes[place_of(one.__code__)]
    items = run.order.put(items, mutant.path.name)
    for item, after in zip(items, [*items[1:], None], strict=True):
        item.config.hook.pytest_runtest_protocol(item=item, nextitem=after)
        if run.killer:
            return 1, run.killer, {}
    return 0, "", {}


def place_of(code: CodeType) -> Place:
    """Return the place of a function's code in its module."""
    return code.co_qualname, code.co_firstlineno


def functions_of_the_room() -> list[FunctionType]:
    """List all functions of the guard that are in memory."""
    gc.unfreeze()  # `conftest.py` has hidden all objects from `gc.get_objects`
    found = [one for one in gc.get_objects() if isinstance(one, FunctionType)]
    gc.freeze()
    return [one for one in found if (one.__module__ or "").startswith("exograv.safety")]


def _codes(code: CodeType) -> Iterator[tuple[Place, CodeType]]:
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield place_of(one), one
            yield from _codes(one)


def prepare() -> None:
    """Set the folder and the Hypothesis profile for all children."""
    os.chdir(ROOT)
    # No shrinking: the fact that a test fails is enough.
    phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
    hypothesis.settings.register_profile("mutants", deadline=None, derandomize=True, phases=phases, database=None)


def digest(*texts: str) -> str:
    """Return a short hash of some texts."""
    return hashlib.sha256("\0".join(texts).encode()).hexdigest()[:16]


def digest_of(*files: Path) -> str:
    """Return a short hash of the contents of files."""
    return digest(*(file.read_text(encoding="utf-8") for file in files))


def digests_of(files: list[Path]) -> dict[str, str]:
    """Return a hash of each test, with all that is no test in its module and in the modules that this one imports."""
    trees = {file.stem: ast.parse(file.read_text(encoding="utf-8")) for file in files}
    own, imported, tests = dict[str, str](), dict[str, set[str]](), dict[str, dict[str, str]]()
    for name, tree in trees.items():
        imports = [one for one in tree.body if isinstance(one, ast.Import | ast.ImportFrom)]
        is_test = [isinstance(one, ast.FunctionDef) and one.name.startswith("test_") for one in tree.body]
        imported[name] = {one.module or "" for one in imports if isinstance(one, ast.ImportFrom) and one.level} & {
            *trees
        }
        pairs = list(zip(tree.body, is_test, strict=True))
        own[name] = "\n".join(ast.unparse(one) for one, test in pairs if not test and one not in imports)
        tests[name] = {one.name: ast.unparse(one) for one, test in pairs if test and isinstance(one, ast.FunctionDef)}

    def needed(name: str) -> set[str]:
        return {name}.union(*(needed(other) for other in imported[name]))

    return {
        f"{name}.py::{test}": digest(text, *(own[other] for other in sorted(needed(name))))
        for name in trees
        for test, text in tests[name].items()
    }


class Log:
    """Results of earlier runs."""

    def __init__(self, path: Path):
        self.path, self.known = path, dict[str, dict]()
        files = sorted(TESTS.glob("*.py"))
        self.tests = digest_of(*files)
        self.digests = digests_of(files)
        """Hash of each test, as it was at the begin."""
        self.read()

    def read(self) -> None:
        """Read what this process and others have noted."""
        if self.path.is_file():
            for line in self.path.read_text(encoding="utf-8").splitlines():
                entry = json.loads(line)
                self.known[entry["key"]] = entry

    def result(self, key: str) -> bool | None:
        """Return True if the mutant was killed, and None if its result is not known or not valid any more."""
        entry = self.known.get(key)
        if entry is None:
            return None
        return entry["killed"] if entry["tests"] == self._valid(entry.get("killer", "")) else None

    def _valid(self, killer: str) -> str:
        return self.digests.get(Path(killer).name.split("[")[0], self.tests)

    def note(self, key: str, name: str, result: Result) -> None:
        """Append a result."""
        code, killer, _ = result
        self.add({"key": key, "killed": code != 0, "name": name, "code": code, "killer": killer})

    def add(self, entry: dict[str, Any]) -> None:
        """Append an entry, which is valid as long as its tests."""
        entry["tests"] = self._valid(entry.get("killer", ""))
        self.known[entry["key"]] = entry
        with self.path.open("a", encoding="utf-8") as log:
            log.write(json.dumps(entry) + "\n")


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
    """Read the table of equivalent mutants."""
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


class Hunt:
    """Run of some mutants; the results are in the log."""

    def __init__(self, log: Log, workers: int):
        self.log, self.workers = log, workers
        key = digest("unchanged", *(path.read_text(encoding="utf-8") for path in modules()))
        if log.result(key) is None:
            for _, result in side_by_side([None], lambda _: run_imported({}, Order({})), 1, 1e4):
                if result[0] != 0:
                    sys.exit(f"{result[1]} fails on the unchanged source. Correct it: a mutant would prove nothing.")
                log.add({"key": key, "killed": False, "name": "unchanged", "seconds": result[2]})
        self.order = Order(log.known[key]["seconds"])
        self.limit_s = TIMES_AS_LONG * sum(self.order.seconds.values()) + LONGER_S
        self.called = set[tuple[str, Place]]()

    def run(self, found: list[Mutant]) -> None:
        """Try mutants inside functions in one process with collected tests, and then all others."""
        for _ in side_by_side([None], lambda _: self._inside(found), 1, 1e6):
            pass
        self.log.read()

        def imported(one: Mutant) -> Result:
            return run_imported({name_of(one.path): one.tree()}, self.order, one.path.name)

        self._note_all(side_by_side(self._unknown(found), imported, self.workers, self.limit_s), sys.stdout.fileno())

    def _unknown(self, found: list[Mutant]) -> list[Mutant]:
        return [one for one in found if self.log.result(one.key) is None]

    def _inside(self, found: list[Mutant]) -> Result:
        out, run = os.dup(1), Run(self.order, "")
        be_quiet()

        def work(items: list[pytest.Item], run: Run) -> None:
            sys.setprofile(None)
            functions = functions_of_the_room()
            ready = [one for one in self._unknown(found) if one.function and not self._was_called(one)]
            results = side_by_side(
                ready, lambda one: run_collected(items, run, functions, one), self.workers, self.limit_s
            )
            self._note_all(results, out)

        sys.setprofile(self._note_call)
        return run_pytest(Prepared(work, run), run), "", {}

    def _note_call(self, frame: FrameType, event: str, _: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(str(ROOM)):
            self.called.add((code.co_filename, place_of(code)))

    def _was_called(self, one: Mutant) -> bool:
        return any(file == str(one.path) and name == one.function for file, (name, _) in self.called)

    def _note_all(self, results: Iterator[tuple[Mutant, Result]], out: int) -> None:
        for one, result in results:
            if result[0] == NOT_FOUND:
                continue
            self.log.note(one.key, one.name, result)
            if result[0] == 0:
                os.write(out, f"survived: {one.name}\n".encode())
            elif result[1]:
                self.order.note(result[1])


def hunt(options: argparse.Namespace) -> None:
    """Try the mutants; print survivors, and how many were killed in each file."""
    found = [one for one in mutants() if options.only in one.path.name]
    rows = [row for row in equivalents() if options.only in row.file]
    equivalent, wrong = find_equivalents(found, rows)
    if wrong:
        sys.exit(
            "\n".join([f"{EQUIVALENT.name} has changes that are no mutants, or of another number of places:", *wrong])
        )
    if options.sample:
        found = random.Random(options.seed).sample(found, min(options.sample, len(found)))
    tried = [one for one in found if options.equivalent or one not in equivalent]
    run = Hunt(Log(options.log), options.workers)
    run.run(tried)
    log = run.log
    log.read()
    counts = dict[str, Counter[str]]()
    for one in found:
        state = "killed" if log.result(one.key) else "equivalent" if one in equivalent else "survived"
        if state == "killed" and one in equivalent:
            print(f"killed, so not equivalent: {one.name}")
        for name in (one.path.name, "all"):
            counts.setdefault(name, Counter())[state] += 1
    for name, count in counts.items():
        tried_here = count.total() - count["equivalent"]
        share = 100.0 * count["killed"] / max(tried_here, 1)
        print(
            f"{name}: {count.total()} mutants, {count['killed']} killed, {count['equivalent']} equivalent, "
            f"{count['survived']} survived; {share:.1f} % of those that are not equivalent killed"
        )


def show(options: argparse.Namespace) -> None:
    """Print each survivor in the log as a row of the table of equivalent mutants."""
    log = Log(options.log)
    found = [one for one in mutants() if options.only in one.path.name]
    equivalent, _ = find_equivalents(found, equivalents())
    for one in found:
        if log.result(one.key) is False and one not in equivalent:
            was, becomes = one.lines()
            print(f"{one.name}\n  {one.path.name} {one.function or '-'}\n    {was}\n    {becomes}")


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

        def seen_by_all() -> Result:
            result = run_imported(trees, Order({}))
            save()
            return result

        [(_, (code, *_rest))] = side_by_side([None], lambda _: seen_by_all(), 1, 1e4)
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
    parser.add_argument("--workers", type=int, default=1, help="number of mutants at a time")
    parser.add_argument("--equivalent", action="store_true", help="also try the mutants listed as equivalent")
    parser.add_argument("--lines", action="store_true", help="only print the changed lines of the survivors in the log")
    parser.add_argument("--branches", action="store_true")
    parser.add_argument("--count", action="store_true", help="only print the number of mutants")
    options = parser.parse_args()
    prepare()
    if options.count:
        for name, count in Counter(one.path.name for one in mutants()).items():
            print(name, count)
    elif options.lines:
        show(options)
    elif options.branches:
        watch()
    else:
        hunt(options)


if __name__ == "__main__":
    main()
