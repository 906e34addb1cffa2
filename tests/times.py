"""CPU time of a test run by room, and of the slowest tests, printed at its end unless `-q` is given.

The time is that of the processor, in the tests' process and in its children: other programs on the computer change it
little. A fixture counts for the test that needs it first.
"""

import os
from collections import Counter
from collections.abc import Generator
from typing import Any

import pytest
from tests import preloaded

SLOWEST = 10
"""Number of tests that are named."""

SPENT = pytest.StashKey[Counter[str]]()
"""CPU time of each test [s]."""

COLLECTION = pytest.StashKey[list[float]]()
"""CPU time of each process until it has collected the tests [s]."""


class Clock:
    """Time of the last reading."""

    cpu_s = 0.0


def cpu_s() -> float:
    """CPU time of this process, of its ended children, and of its commands [s]."""
    now = os.times()
    return now.user + now.system + now.children_user + now.children_system + preloaded.Spent.cpu_s


def pytest_configure(config: pytest.Config) -> None:
    config.stash[SPENT] = Counter()
    config.stash[COLLECTION] = []


def pytest_collection_finish(session: pytest.Session) -> None:
    Clock.cpu_s = cpu_s()
    if not session.items:
        return
    if (output := getattr(session.config, "workeroutput", None)) is not None:
        output["collection_cpu_s"] = Clock.cpu_s
    else:
        session.config.stash[COLLECTION].append(Clock.cpu_s)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, Any, Any]:
    """Write on the report of a test's phase how much CPU time has passed since the report before."""
    report = yield
    now = cpu_s()
    report.cpu_s, Clock.cpu_s = now - Clock.cpu_s, now
    return report


@pytest.hookimpl(optionalhook=True)
def pytest_testnodedown(node: Any) -> None:
    """Take over the time of a worker's collection."""
    output = getattr(node, "workeroutput", None) or {}
    node.config.stash[COLLECTION].append(output.get("collection_cpu_s", 0.0))


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    spent = config.stash[SPENT]
    for reports in terminalreporter.stats.values():
        for report in reports:
            if hasattr(report, "cpu_s"):
                spent[report.nodeid] += report.cpu_s
    if config.get_verbosity() < 0 or not spent:
        return
    terminalreporter.section("CPU time")
    for line in summary(spent, config.stash[COLLECTION]):
        terminalreporter.write_line(line)


def summary(spent: Counter[str], collection: list[float]) -> list[str]:
    """Lines of a table by room, and of the slowest tests.

    Args:
        spent: CPU time by the name of a test [s].
        collection: CPU time of each process until it has collected the tests [s].
    """
    rooms, tests = Counter[str](), Counter[str]()
    for name, seconds in spent.items():
        rooms[room_of(name)] += seconds
        tests[room_of(name)] += 1
    lines = [f"{seconds:8.1f} s  {room}, {tests[room]} tests" for room, seconds in rooms.most_common()]
    lines.append(f"{sum(collection):8.1f} s  start and collection, {len(collection)} processes")
    lines += [f"{sum(rooms.values()) + sum(collection):8.1f} s  sum", "", "The slowest tests:"]
    return [*lines, *(f"{seconds:8.1f} s  {name}" for name, seconds in spent.most_common(SLOWEST))]


def room_of(name: str) -> str:
    """Room of a test: its folder in `tests`, which is also the name of that room in `src`."""
    path = name.partition("::")[0].split("/")
    return path[1] if len(path) > 2 else path[0]
