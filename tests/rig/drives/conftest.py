"""Simulated drives in another process, on each bus, with the commands of an operator at the bench."""

import json
import os
import queue
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from tests.preloaded import Started

from exograv.model.description import load_rig
from exograv.rig.drives.canopen import CanopenRig
from exograv.rig.drives.moteus import MoteusRig
from exograv.rig.drives.settings import Drives, load_drives
from exograv.rig.drives.simulated.address import free_port
from exograv.rig.drives.udp import UdpRig

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples" / "drives"
STARTS_S, ANSWERS_S = 60.0, 10.0
PATIENT_S = 0.5
"""Time-out for an answer in lock-step [s]; a disconnected drive costs as much."""


@dataclass(frozen=True)
class Driver:
    """Driver of a bus under test, and the contents of that bus's example."""

    make: Callable[..., Any]
    address: tuple[str, str]
    """Text of the example, and its replacement with a free port or path."""

    turned: tuple[str, str]
    """Text of the example, and its replacement with the elbow's drive turned round."""

    plates: dict[str, float]
    """Values that drives on this bus report, by key, each with a wrong value."""

    counts_samples: bool
    """True if drives on this bus say which of their samples they report."""

    sets_watchdogs: bool
    """True if drives on this bus take the watchdog of the file; otherwise they report their own."""


BUSES = {
    "udp": Driver(
        UdpRig,
        ("port = 47100", "port = {port}"),
        ("node = 4\n", "node = 4\nsign = -1\n"),
        {"current_rated_A": 2.5, "current_max_A": 12.0, "brake_Nms_per_rad": 1.0},
        counts_samples=True,
        sets_watchdogs=False,
    ),
    "canopen": Driver(
        CanopenRig,
        ('"239.74.163.2"', '"239.74.163.2:{port}"'),
        ("node = 4\nsign = -1\n", "node = 4\n"),
        {"current_rated_A": 2.5},
        counts_samples=False,
        sets_watchdogs=True,
    ),
    "moteus": Driver(
        MoteusRig,
        ('path = "fdcanusb"', 'path = "{folder}/fdcanusb"'),
        ("node = 4\n", "node = 4\nsign = -1\n"),
        {"current_max_A": 12.0, "brake_Nms_per_rad": 1.0},
        counts_samples=False,
        sets_watchdogs=False,
    ),
}
"""Drivers on which the battery runs, by bus."""


@dataclass
class DeviceProcess:
    """Simulated device, or a reference peer, and the lines that it prints."""

    process: subprocess.Popen[str] | Started
    seen: list[str] = field(default_factory=list)

    def __post_init__(self):
        self._lines: queue.SimpleQueue[str] = queue.SimpleQueue()
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self._lines.put(line.rstrip())

    def line(self, holds: Callable[[str], bool], within_s: float = ANSWERS_S) -> str:
        """Return the next line for which `holds` is true."""
        ends = time.monotonic() + within_s
        while True:
            try:
                line = self._lines.get(timeout=max(ends - time.monotonic(), 0.01))
            except queue.Empty as error:
                raise AssertionError(f"not said within {within_s} s; said: {self.seen[-20:]}") from error
            self.seen.append(line)
            if holds(line):
                return line

    def do(self, order: str) -> None:
        """Type a line, and wait until it is executed."""
        self.type(order)
        self.line(lambda line: line.endswith(f"done: {order}"))

    def type(self, order: str) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(order + "\n")
        self.process.stdin.flush()

    def report(self) -> dict[str, dict[str, Any]]:
        """Return the state of each drive by the device's own report."""
        self.type("report")
        return json.loads(self.line(lambda line: line.startswith("{")))["joints"]

    def forget_lines(self) -> None:
        while not self._lines.empty():
            self._lines.get()
        self.seen.clear()

    def end(self) -> None:
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout):
            if stream is not None:
                stream.close()


def start_device(command: list[str], is_ready: str) -> DeviceProcess:
    """Start a device, and wait until it listens."""
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src"), "OPENBLAS_NUM_THREADS": "1"}
    pipe = subprocess.PIPE
    process = subprocess.Popen(command, text=True, env=environment, stdin=pipe, stdout=pipe, stderr=subprocess.STDOUT)
    device = DeviceProcess(process)
    device.line(lambda line: is_ready in line, STARTS_S)
    return device


def start_drives(bus: str, path: Path, lock_step: bool, *options: str) -> DeviceProcess:
    """Simulate these drives, and wait until they listen."""
    words = ["drive-sim", bus, "--drives", str(path), *options, *(("--lock-step",) if lock_step else ())]
    device = DeviceProcess(Started(*words))
    device.line(lambda line: "Reached at" in line, STARTS_S)
    return device


def drives_on(folder: Path, bus: str, *changes: tuple[str, str]) -> Path:
    """Write the example of a bus with a free address and with changes."""
    text = (EXAMPLES / f"{bus}.toml").read_text(encoding="utf-8")
    old, new = BUSES[bus].address
    for right, wrong in ((old, new.format(port=free_port(), folder=folder)), *changes):
        assert right in text
        text = text.replace(right, wrong, 1)
    path = folder / f"{bus}.toml"
    path.write_text(text, encoding="utf-8")
    return path


def drives_of(path: Path) -> Drives:
    return load_drives(path, load_rig("recupera_like"))


@pytest.fixture(scope="module", params=sorted(BUSES))
def served(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[str, Path, Any]]:
    """Bus, `drives.toml` and process of one device for all tests of a file, in lock-step as the file's LOCK_STEP."""
    path = drives_on(tmp_path_factory.mktemp(request.param), request.param)
    device = start_drives(request.param, path, request.module.LOCK_STEP)
    yield request.param, path, device
    device.end()


@pytest.fixture
def bench(served: tuple[str, Path, DeviceProcess]) -> Iterator[DeviceProcess]:
    """Bench in its initial state, which the fixture restores after the test."""
    device = served[2]
    device.forget_lines()
    yield device
    for order in (
        "mend",
        "release",
        *(f"{act} {joint}" for act in ("plug", "thaw") for joint in load_rig("recupera_like").joints),
    ):
        device.do(order)


@pytest.fixture
def drives(served: tuple[str, Path, DeviceProcess]) -> Drives:
    return drives_of(served[1])


@pytest.fixture
def driver(served: tuple[str, Path, DeviceProcess]) -> Driver:
    """Driver of the bus."""
    return BUSES[served[0]]


def patient(driver: Driver) -> Callable[[Drives], Any]:
    """Driver of a bus in lock-step with a time-out for a busy computer."""
    return partial(driver.make, answer_s=PATIENT_S, lock_step=True)


@pytest.fixture
def make_rig(request: pytest.FixtureRequest, driver: Driver) -> Callable[[Drives], Any]:
    """Driver of the bus; in lock-step it waits for every answer."""
    return patient(driver) if request.module.LOCK_STEP else driver.make


@pytest.fixture
def rig(bench: DeviceProcess, drives: Drives, make_rig: Callable[[Drives], Any]) -> Iterator[Any]:
    """Rig that is found and checked, but not switched on."""
    with make_rig(drives) as entered:
        yield entered


@pytest.fixture(params=sorted(BUSES))
def start(request: pytest.FixtureRequest) -> Iterator[Callable[..., Any]]:
    """Start a device of a test's own in lock-step, with its wiring; return the driver, not yet entered."""
    devices: list[DeviceProcess] = []

    def started(folder: Path, is_turned: bool, options: tuple[str, ...]) -> Any:
        driver = BUSES[request.param]
        path = drives_on(folder, request.param, *((driver.turned,) if is_turned else ()))
        devices.append(start_drives(request.param, path, True, *options))
        return patient(driver)(drives_of(path))

    yield started
    for device in devices:
        device.end()
