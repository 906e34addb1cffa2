"""Checks of this computer: requirements of exograv, and the time of a control tick."""

import importlib.util
import os
import platform
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

from exograv.errors import KernelError
from exograv.extras import missing_by_extra
from exograv.model.description import rig_names
from exograv.safety.native.library import LIBRARY, NOT_COMPILED

CORE, OPTIONAL = ("numpy", "pydantic"), ("casadi", "mcap", "mujoco-core", "scipy")
"""Packages without which nothing runs, and packages of extras whose version matters in a report of a fault."""

TICKS = 2000
"""Number of ticks that are timed."""

PERIOD_US = 1000.0
"""Period of the control loop [µs]."""


@dataclass(frozen=True)
class Check:
    """Result of one check of this computer."""

    name: str
    ok: bool
    text: str


@dataclass(frozen=True)
class ComputerCheck:
    """Results of all checks of this computer."""

    ok: bool
    computer: str
    checks: list[Check]
    tick_us: dict[str, float] | None
    missing: dict[str, list[str]]
    """Packages that are not installed, by extra; an empty list for an extra that is complete."""

    @property
    def has_all_it_needs(self) -> bool:
        """True if all requirements are met. A slow tick does not count."""
        return all(check.ok for check in self.checks if check.name != "tick")


def examine_computer(folder: Path) -> ComputerCheck:
    """Check versions, a writable folder, and the time of a control tick. An extra that is not installed is no fault.

    `ok` is True if exograv runs on this computer. It does not say if the computer may drive a worn machine: `loop_test`
    tests that, because most computers run the twin, the study and the report only.
    """
    optional = (_package(name) for name in OPTIONAL)
    checks = [_python(), *(_package(name) for name in CORE), *(one for one in optional if one.ok), _writable(folder)]
    has_kernels = importlib.util.find_spec("casadi") is not None
    if has_kernels:
        checks.append(_kernels())
    checks.append(_guard())
    checks.append(Check("machines", bool(rig_names()), ", ".join(rig_names()) or "none found"))
    tick = _tick_percentiles() if has_kernels and all(check.ok for check in checks[1:]) else None
    if tick is not None:
        ok = tick["p99"] < PERIOD_US / 2
        text = f"median {tick['p50']} µs, p99 {tick['p99']} µs of a period of 1000 µs"
        checks.append(Check("tick", ok, text))
    computer = f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores"
    return ComputerCheck(all(check.ok for check in checks), computer, checks, tick, missing_by_extra())


def _python() -> Check:
    return Check("python", sys.version_info >= (3, 11), platform.python_version())


def _package(name: str) -> Check:
    try:
        return Check(name, True, version(name))
    except PackageNotFoundError:
        return Check(name, False, "not installed: pip install 'exograv[all]'")


def _kernels() -> Check:
    """Check the kernels. Without native code they are slower but equally correct."""
    try:
        from exograv.kernel import object_code

        return Check("kernels", True, f"native code for {object_code.processor().name}")
    except ImportError as error:
        return Check("kernels", False, f"{error}: pip install 'exograv[control]'")
    except KernelError as error:
        return Check("kernels", True, f"virtual machine. {error}")


def _guard() -> Check:
    """Check the guard. As Python it gives the same torques, too slowly for a worn machine."""
    return Check("guard", True, NOT_COMPILED if LIBRARY is None else "compiled")


def _writable(folder: Path) -> Check:
    try:
        # The folder itself is made by the command that writes into it.
        existing = next(one for one in (folder, *folder.resolve().parents) if one.exists())
        with tempfile.TemporaryFile(dir=existing):
            pass
    except OSError as error:
        return Check("out", False, f"{folder}: {error.strerror}; give another folder with --out")
    return Check("out", True, f"{folder} can be written")


def _tick_percentiles() -> dict[str, float]:
    """Return percentiles of the time of the control tick of the default machine [µs]."""
    from exograv.recording.rounding import percentiles

    return percentiles(Counter(_tick_times()))


def _tick_times() -> list[float]:
    """Return times of the control tick of the default machine [µs]."""
    from exograv.procedures.self_test.nominal_tick import nominal_tick
    from exograv.signals import Reference

    tick, x, assembly = nominal_tick()
    q, still, times = assembly.description.donning_posture, np.zeros(assembly.n), []
    for _ in range(TICKS):
        start = time.perf_counter_ns()
        tick.step(q, still, Reference(q, still, still), x)
        times.append(1e-3 * (time.perf_counter_ns() - start))
    return times
