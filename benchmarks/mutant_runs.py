"""Runs of a room's tests on a mutant, each in a forked process; tests that kill often and quickly run first."""

import ast
import contextlib
import ctypes
import gc
import importlib.abc
import importlib.machinery
import importlib.util
import json
import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Container, Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis
import hypothesis.extra.numpy
import numpy  # noqa: F401 - imported once for all children
import pytest

import exograv.errors
import exograv.signals  # noqa: F401 - no module of the room
from guard_mutants import ROOT, SOURCE, Mutant, Room, name_of

ALONE, FIGURES = "test_modes.py", "test_figures.py"
FORGET, PRIOR_KILLS = 0.9, 0.05
"""Share of a test's earlier kills that counts after the next one, and kills of a test that has none."""

NOT_FOUND = 77
"""Exit code of a run that has found no function to change; such a mutant is imported."""

HANGS_TIMES, SUBREAPER = 10, 36
"""Time of a mutant by the clock, as a multiple of its processor time; option of `prctl` by which orphans come here."""

SITE = Path(__file__).with_name("mutant_site")

Place = tuple[str, int]
"""Qualified name of a function, and its first line."""


class Instead(importlib.abc.MetaPathFinder):
    """Import hook that puts trees in place of modules of the room."""

    def __init__(self, trees: dict[str, ast.Module]):
        self.trees = trees

    def find_spec(self, name: str, path: Any = None, target: Any = None):
        """Return the specification of a module that is replaced, else None."""
        if name not in self.trees:
            return None
        file = str(SOURCE.parent.joinpath(*name.split(".")).with_suffix(".py"))
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
                if limit_s < 1e4:
                    signal.setitimer(signal.ITIMER_REAL, HANGS_TIMES * limit_s)
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
    ctypes.CDLL(None).prctl(SUBREAPER, 1, 0, 0, 0)
    waiting, at_work = list(reversed(jobs)), dict[int, tuple[Any, Child]]()
    while waiting or at_work:
        while waiting and len(at_work) < workers:
            job = waiting.pop()
            child = Child(lambda job=job: run(job), limit_s)
            at_work[child.pid] = job, child
        pid, status = os.wait()
        if pid in at_work:
            job, child = at_work.pop(pid)
            _end_orphans(at_work)
            yield job, child.result(status)


def _end_orphans(at_work: Container[int]) -> None:
    """Kill processes that a run has left behind."""
    me = os.getpid()
    for pid in Path(f"/proc/{me}/task/{me}/children").read_text(encoding="utf-8").split():
        if int(pid) not in at_work:
            with contextlib.suppress(ProcessLookupError):
                os.kill(int(pid), signal.SIGKILL)


def be_wrong_elsewhere(mutant: Mutant) -> None:
    """Let each interpreter that this process starts from now on import the mutant."""
    with tempfile.NamedTemporaryFile("w", suffix=".py", delete=False, encoding="utf-8") as file:
        file.write(ast.unparse(mutant.tree()))
    os.environ["EXOGRAV_MUTANT"] = "\n".join((name_of(mutant.path), str(mutant.path), file.name))
    os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(SITE), os.environ.get("PYTHONPATH"))))


def be_quiet() -> None:
    """Send all output of this process to nowhere."""
    if "MUTANTS_ALOUD" not in os.environ:
        quiet = os.open(os.devnull, os.O_WRONLY)
        os.dup2(quiet, 1)
        os.dup2(quiet, 2)


def run_pytest(room: Room, *plugins: object) -> int:
    """Run the tests in this process and return pytest's exit code."""
    options = ["-x", "-q", "-s", "-p", "no:cacheprovider", "-p", "no:xdist", "--assert=plain"]
    options += ["--hypothesis-profile=mutants", "-o", "addopts=--import-mode=importlib", "--rootdir", str(ROOT)]
    return int(pytest.main([*options, *map(str, room.tests)], [*plugins]))


def run_imported(room: Room, trees: dict[str, ast.Module], order: Order, module: str = "") -> Result:
    """Run the tests, which import trees in place of modules."""
    be_quiet()
    sys.meta_path.insert(0, Instead(trees))
    run = Run(order, module)
    code = run_pytest(room, run)
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


def functions_of(room: Room) -> list[FunctionType]:
    """List all functions of the room that are in memory."""
    names = {name_of(path) for path in room.modules}
    gc.unfreeze()  # `conftest.py` has hidden all objects from `gc.get_objects`
    found = [one for one in gc.get_objects() if isinstance(one, FunctionType)]
    gc.freeze()
    return [one for one in found if one.__module__ in names]


def _codes(code: CodeType) -> Iterator[tuple[Place, CodeType]]:
    for one in code.co_consts:
        if isinstance(one, CodeType):
            yield place_of(one), one
            yield from _codes(one)


def prepare() -> None:
    """Set the folder and the Hypothesis profile for all children."""
    os.chdir(ROOT)
    sys.path.append(str(ROOT))  # an interpreter that a test starts imports the test
    # No shrinking: the fact that a test fails is enough.
    phases = (hypothesis.Phase.explicit, hypothesis.Phase.generate)
    hypothesis.settings.register_profile("mutants", deadline=None, derandomize=True, phases=phases, database=None)
