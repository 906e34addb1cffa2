"""Interpreter with programs of others, against which some tests try ours.

None of them is a dependency of the project. Their packages go into an environment of their own, whose interpreter the
environment variable names:

    python -m venv peers
    peers/bin/pip install labrecorder pylsl pyzeros ros-rclpy ros-rmw-fastrtps-cpp ros-sensor-msgs ros-std-msgs
    EXOGRAV_PEERS_PYTHON=peers/bin/python pytest tests/runtime/ros2 tests/study/importers
"""

import os
import subprocess

import pytest

VARIABLE = "EXOGRAV_PEERS_PYTHON"


def peers_python(*packages: str) -> str:
    """Return the interpreter; skip the test module if it is not named, or lacks a package."""
    python = os.environ.get(VARIABLE, "")
    if not python:
        pytest.skip(f"{VARIABLE} names no interpreter with {', '.join(packages)}", allow_module_level=True)
    tried = subprocess.run(
        [python, "-c", f"import {', '.join(packages)}"], env=own_environment(), capture_output=True, check=False
    )
    if tried.returncode:
        pytest.skip(f"{python} cannot import {', '.join(packages)}", allow_module_level=True)
    return python


def own_environment() -> dict[str, str]:
    """Return the environment without the project's own packages."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
