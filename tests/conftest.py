"""Settings of all tests, and fixtures that run a script beside a test.

Property tests have no deadline, and draw the same examples every time on a server. A script runs in a process of its
own, because shape checks do not slow it there; a module that uses one names it: `SCRIPT`.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

# As the command line does: threads of OpenBLAS wait for each other, and our matrices are small. Before NumPy comes.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import pytest
from hypothesis import settings

# The first call compiles a kernel, which takes longer than any fair deadline for the second.
settings.register_profile("desk", deadline=None)
settings.register_profile("server", deadline=None, derandomize=True)
settings.load_profile("server" if os.environ.get("CI") else "desk")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Put whole flights first: a long test that begins last leaves the other processes idle."""
    items.sort(key=lambda item: "scenario" not in item.path.parts)


BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
"""Its modules can be imported by tests and their scripts."""

Verdicts = dict[str, dict[str, Any]]


def verdicts(request: pytest.FixtureRequest, which: str) -> Verdicts:
    script = request.path.with_name(request.module.SCRIPT)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(BENCHMARKS), os.environ.get("PYTHONPATH", "")])}
    command = [sys.executable, str(script), which]
    run = subprocess.run(command, check=True, capture_output=True, text=True, env=environment)
    return json.loads(run.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def quick(request: pytest.FixtureRequest) -> Verdicts:
    """Cases that take a second or two each."""
    return verdicts(request, "quick")


@pytest.fixture(scope="module")
def slow(request: pytest.FixtureRequest) -> Verdicts:
    """The others, for slow tests only."""
    return verdicts(request, "slow")
