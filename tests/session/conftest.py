"""Verdicts of a script beside the test, by the name of a case: a process of its own is not slowed by shape checks.

A module that uses them names it: `SCRIPT`.
"""

import json
import subprocess
import sys
from typing import Any

import pytest

Verdicts = dict[str, dict[str, Any]]


def verdicts(request: pytest.FixtureRequest, which: str) -> Verdicts:
    script = request.path.with_name(request.module.SCRIPT)
    run = subprocess.run([sys.executable, str(script), which], check=True, capture_output=True, text=True)
    return json.loads(run.stdout.splitlines()[-1])


@pytest.fixture(scope="module")
def quick(request: pytest.FixtureRequest) -> Verdicts:
    """Cases that take a second or two each."""
    return verdicts(request, "quick")


@pytest.fixture(scope="module")
def slow(request: pytest.FixtureRequest) -> Verdicts:
    """The others, for slow tests only."""
    return verdicts(request, "slow")
