"""Server of `tests.preloaded`: it imports the rooms of a flight, then forks for every request that it reads."""

import atexit
import importlib
import json
import os
import pkgutil
import runpy
import signal
import sys
import threading
import traceback
import warnings
from typing import Any, NoReturn

from exograv import cli

ROOMS = ("model", "dynamics", "safety", "control", "identification", "rig", "task", "recording", "storage", "loop")
ROOMS += ("procedures", "laboratory", "live", "report.of_recording")
"""Rooms of a flight. A study imports pandas, which starts a thread, and a fork of a process with threads can hang."""


def import_rooms() -> None:
    """Import every module of the rooms, except those whose package is not installed here."""
    assert cli.ACTIONS
    for room in ROOMS:
        package = importlib.import_module(f"exograv.{room}")
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            try:
                importlib.import_module(module.name)
            except ModuleNotFoundError as error:
                if (error.name or "").partition(".")[0] == "exograv":
                    raise
    if os.path.exists("/proc/self/task"):
        assert len(os.listdir("/proc/self/task")) == 1, "a preloaded package started a thread"


def serve() -> None:
    """Answer each request: with the process that began, or with exit status and CPU time [s] of the one that ended."""
    for line in sys.stdin:
        request = json.loads(line)
        if "await" in request:
            _, status, usage = os.wait4(request["await"], 0)
            print(json.dumps([os.waitstatus_to_exitcode(status), usage.ru_utime + usage.ru_stime]), flush=True)
            continue
        child = os.fork()
        if child == 0:
            run(request)
        print(json.dumps([child, 0.0]), flush=True)


def run(request: dict[str, Any]) -> NoReturn:
    """Be the process of one command until its end."""
    os.setpgid(0, 0)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    # A pipe opens when the test opens its other end, in the same order.
    for stream, path, flags in (
        (0, request["heard"], os.O_RDONLY),
        (1, request["said"], os.O_WRONLY),
        (2, request["complained"], os.O_WRONLY),
    ):
        file = os.open(path, flags | os.O_CREAT, 0o600)
        os.dup2(file, stream)
        os.close(file)
    sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
    sys.stdout = os.fdopen(1, "w", encoding="utf-8", closefd=False)
    sys.stderr = os.fdopen(2, "w", encoding="utf-8", closefd=False, buffering=1)
    os.environ.clear()
    os.environ.update(request["environment"])
    if asked := os.environ.get("PYTHONWARNINGS"):
        warnings._processoptions(asked.split(","))  # type: ignore[attr-defined]  # As Python does at its start.
    # As Python does at its start.
    sys.path[1:1] = [one for one in os.environ.get("PYTHONPATH", "").split(os.pathsep) if one and one not in sys.path]
    os.chdir(request["folder"])
    code = status_of(request["target"], request["words"])
    threading._shutdown()  # type: ignore[attr-defined]  # Wait for its threads, as Python does at its end.
    atexit._run_exitfuncs()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def status_of(target: str, words: list[str]) -> int:
    """Run a module or a file as the main program, and return its exit status."""
    sys.argv = [target, *words]
    try:
        if target.endswith(".py"):
            sys.path[0] = os.path.dirname(target)
            runpy.run_path(target, run_name="__main__")
        else:
            runpy.run_module(target, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return (end.code or 0) & 0xFF
        print(end.code, file=sys.stderr)
        return 1
    except BaseException:  # noqa: BLE001 - Python's own top level does the same.
        traceback.print_exc()
        return 1
    return 0


import_rooms()
serve()
