"""Settings of all tests, and fixtures that run a script beside a test.

Property tests have no deadline, and on a server they draw the same examples every time. A script runs in its own
process, because shape checks do not slow it there. A module that uses a script names it: `SCRIPT`.
"""

import gc
import json
import os
from collections.abc import Callable, Generator
from pathlib import Path
from typing import Any

# As in the command line, before NumPy is imported: our matrices are small, and OpenBLAS threads wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings
from tests import preloaded, seeds, shared, times
from tests.shared import Prepare

# The first call compiles a kernel, which takes longer than a deadline for later calls would allow.
settings.register_profile("desk", deadline=None)
settings.register_profile("quick", deadline=None, max_examples=30)
settings.register_profile("server", deadline=None, derandomize=True)
settings.load_profile("server" if os.environ.get("CI") else "desk")

QUICK = "not long"
"""Part of the marker expression by which `make test` leaves out long tests."""


def pytest_configure(config: pytest.Config) -> None:
    """Measure the time of tests, and print it at the end; draw fewer examples in a run without long tests."""
    if not config.pluginmanager.is_registered(times):
        config.pluginmanager.register(times, "times")
    if QUICK in config.option.markexpr:
        settings.load_profile("quick")


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection() -> Generator[None, object, object]:
    """Collect without garbage collections, and keep the collected tests, a million objects, out of later ones.

    Raises:
        UsageError: The import of a test module has changed the environment of all tests and of their commands.
    """
    before = _own_variables()
    gc.disable()
    try:
        collected = yield
    finally:
        gc.enable()
        gc.freeze()
    if changed := {name for name, _ in _own_variables() ^ before}:
        names = ", ".join(sorted(changed))
        raise pytest.UsageError(f"The import of a test module has set {names} for all tests. Set it where it is used.")
    return collected


def _own_variables() -> set[tuple[str, str]]:
    return {(name, value) for name, value in os.environ.items() if name.startswith("EXOGRAV_")}


@pytest.hookimpl(trylast=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Keep imported modules, kernels and syntax trees out of later garbage collections, after each file."""
    if nextitem is None or nextitem.path != item.path:
        gc.collect()
        gc.freeze()


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark further seeds as long, and put whole flights first.

    A long test that begins last leaves the other processes idle.
    """
    seeds.mark_further(items)
    items.sort(key=lambda item: "scenario" not in item.path.parts)


@pytest.fixture(scope="session")
def prepare_once(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Callable[[tuple[str, ...], Prepare], Path]:
    """Function that returns the folder of a preparation, which all workers and later runs of the same source share."""
    cache = getattr(request.config, "cache", None)
    if cache is not None:
        parent = cache.mkdir(shared.FOLDER)
    else:
        root = tmp_path_factory.getbasetemp()
        parent = (root.parent if "PYTEST_XDIST_WORKER" in os.environ else root) / shared.FOLDER
    return lambda words, prepare: shared.prepared(parent, words, prepare)


BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
"""Folder of the benchmarks; tests and their scripts can import its modules."""

Verdicts = dict[str, dict[str, Any]]


def verdicts(request: pytest.FixtureRequest, which: str) -> Verdicts:
    path = request.path.with_name(request.module.SCRIPT)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(BENCHMARKS), os.environ.get("PYTHONPATH", "")])}
    return json.loads(preloaded.script(path, which, environment=environment).stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def quick(request: pytest.FixtureRequest) -> Verdicts:
    """Run the cases that take a second or two each."""
    return verdicts(request, "quick")


@pytest.fixture(scope="module")
def slow(request: pytest.FixtureRequest) -> Verdicts:
    """Run the other cases, for slow tests only."""
    return verdicts(request, "slow")
