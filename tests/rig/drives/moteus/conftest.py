"""Simulated moteus controllers without a twin, served by a thread."""

import threading
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from exograv.model.description import load_rig
from exograv.rig.drives.moteus.simulated.bus import MoteusDevices
from exograv.rig.drives.settings import Drives, load_drives
from exograv.rig.drives.simulated.firmware import SimulatedDrive
from exograv.rig.drives.simulated.plant import Plant

ROOT = Path(__file__).parents[4]


class StillPlant(Plant):
    """Plant whose joints stand at different positions; a motor's current is the output of its drive."""

    def __init__(self, drives: Drives):
        self.each = tuple(SimulatedDrive(one, drives.watchdog_s) for one in drives.each)
        twin: Any = SimpleNamespace(period_s=0.001, t=0.0)
        self.twin, self._ahead_s = twin, 0.0
        self.step()

    def step(self) -> None:
        twin: Any = self.twin
        self.outputs = tuple(drive.step(twin.period_s, twin.t) for drive in self.each)
        twin.t += twin.period_s

    def position(self, joint: int) -> float:
        return 0.5 * (joint + 1)

    def current(self, joint: int) -> float:
        return self.outputs[joint].current


@pytest.fixture
def drives(tmp_path: Path) -> Drives:
    text = (ROOT / "examples" / "drives" / "moteus.toml").read_text(encoding="utf-8")
    path = tmp_path / "moteus.toml"
    path.write_text(text.replace('path = "', f'path = "{tmp_path}/'), encoding="utf-8")
    return load_drives(path, load_rig("recupera_like"))


@pytest.fixture
def plant(drives: Drives) -> StillPlant:
    return StillPlant(drives)


@pytest.fixture
def devices(drives: Drives, plant: Any) -> Iterator[MoteusDevices]:
    """Devices in real time for the duration of a test."""
    is_over = threading.Event()
    with MoteusDevices(plant, drives, say=lambda line: None) as made:
        thread = threading.Thread(target=made.run, args=(is_over.is_set,), daemon=True)
        thread.start()
        yield made
        is_over.set()
        thread.join()
