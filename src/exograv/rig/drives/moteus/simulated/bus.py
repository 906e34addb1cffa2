"""Simulated moteus controllers on one CAN-FD bus, reached through a simulated fdcanusb, with a twin's motors behind."""

import time
from collections.abc import Callable

from exograv.errors import RigError
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.simulated.plant import Plant

from .adapter import SimulatedFdcanusb
from .node import SimulatedMoteus
from .registers import NOTHING, READ, WRITE

STALL_S = 0.005
"""A pause of this process from which on its clock is set anew: real drives do not pause, so their time stands still."""

LISTEN_S = 0.01
"""Between two looks at whether to stop, in lock-step."""

SIZES = (*range(9), 12, 16, 20, 24, 32, 48, 64)
ANSWER_WANTED, NUMBER = 0x8000, 0x7F


class MoteusDevices:
    """The bus end of a plant; a context manager, which owns the adapter."""

    def __init__(self, plant: Plant, drives: Drives, lock_step: bool = False, say: Callable[[str], object] = print):
        """Make the adapter at the path of `drives.toml`; every drive is stopped, and lets go.

        Args:
            plant: What moves.
            drives: With an adapter as their bus.
            lock_step: Step the plant by one period of the loop with each new number that asks, and not by the clock.
            say: Takes a line for each event.

        Raises:
            RigError: These drives are on another bus, or the path is not free.
        """
        if drives.settings.moteus is None:
            raise RigError("drives.toml names no adapter: [moteus] with its path is missing. Add it there.")
        self.plant, self._drives, self._lock_step, self._say = plant, drives, lock_step, say
        self.nodes = tuple(SimulatedMoteus(plant, drives, joint) for joint in range(len(drives.each)))
        self._by_number = {node.number: node for node in self.nodes}
        self._unplugged: set[int] = set()
        self._faults = [drive.fault for drive in plant.each]
        self._steps_a_tick, self._asker = round(drives.period_s / plant.twin.period_s), -1
        self._is_in_use = True
        self._adapter = SimulatedFdcanusb(drives.settings.moteus.path)

    def __enter__(self) -> "MoteusDevices":
        return self

    def __exit__(self, *_: object) -> None:
        self._adapter.close()

    @property
    def where(self) -> str:
        """Its address, for people."""
        return f"fdcanusb at {self._adapter.path}"

    def run(self, until_stopped: Callable[[], bool]) -> None:
        """Serve the bus until told to stop, which is asked once a step."""
        if self._lock_step:
            while not until_stopped():
                self._serve(LISTEN_S)
            return
        due = time.monotonic() + self.plant.twin.period_s
        while not until_stopped():
            while (left := due - time.monotonic()) > 0.0:
                self._serve(left)
            if left < -STALL_S:
                due -= left
            self._serve(0.0)  # what was told meanwhile is heard before any time passes here
            self._step()
            due += self.plant.twin.period_s

    def unplug(self, joint: int) -> None:
        """Take this drive's plug out of the bus; it keeps its power."""
        self._unplugged.add(joint)

    def plug(self, joint: int) -> None:
        """Put it back."""
        self._unplugged.discard(joint)

    def cut(self) -> None:
        """The cable to the host is out."""
        self._adapter.is_cut = True

    def mend(self) -> None:
        """It is in again; what was sent meanwhile is gone."""
        self._serve(0.0)
        self._adapter.is_cut = False

    def _serve(self, seconds: float) -> None:
        for number, data in self._adapter.frames(seconds):
            self._hear(number, data)

    def _hear(self, number: int, data: bytes) -> None:
        node, asker = self._by_number.get(number & NUMBER), number >> 8 & NUMBER
        wants = bool(number & ANSWER_WANTED)
        if self._lock_step and wants and data and data[0] & 0xF0 == READ and asker != self._asker:
            self._asker = asker
            for _ in range(self._steps_a_tick):
                self._step()
        if node is None or node.joint in self._unplugged or not data:
            return
        answer = node.receive(data, self.plant.now)
        self._tell_of(node, data[0] & 0xF0 == WRITE)
        if wants:
            size = next(size for size in SIZES if size >= len(answer))
            self._adapter.say(node.number << 8 | asker, answer.ljust(size, bytes((NOTHING,))))

    def _tell_of(self, node: SimulatedMoteus, is_order: bool) -> None:
        if node.was_asked and self._is_in_use:
            self._say(f"{self.plant.now:.3f} s: a host reads the settings.")
        self._is_in_use = (self._is_in_use or is_order) and not node.was_asked
        node.was_asked = False

    def _step(self) -> None:
        plant = self.plant
        plant.step()
        for node, drive in zip(self.nodes, plant.each, strict=True):
            node.step(plant.twin.period_s, plant.now)
            if drive.fault != self._faults[node.joint]:
                self._faults[node.joint], told_ms = drive.fault, 1e3 * (plant.now - drive.told_at)
                said = drive.fault.name or "no fault"
                joint = self._drives.joints[node.joint]
                self._say(f"{plant.now:.3f} s: {joint}: {said}; told last {told_ms:.1f} ms before")
