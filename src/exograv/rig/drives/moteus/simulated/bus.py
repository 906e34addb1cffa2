"""Simulated moteus controllers on one CAN-FD bus behind a simulated fdcanusb, on a twin's motors."""

from exograv.rig.drives.settings import Drives, MoteusBus
from exograv.rig.drives.simulated.devices import Say, SimulatedDevices
from exograv.rig.drives.simulated.plant import Plant

from .adapter import SimulatedFdcanusb
from .node import SimulatedMoteus
from .registers import NOTHING, READ, WRITE

SIZES = (*range(9), 12, 16, 20, 24, 32, 48, 64)
ANSWER_WANTED, NUMBER = 0x8000, 0x7F


class MoteusDevices(SimulatedDevices):
    """Drives behind an adapter at the path of `drives.toml`. In lock-step each new asking number starts a period."""

    def __init__(self, plant: Plant, drives: Drives, lock_step: bool = False, say: Say = print):
        """Make the adapter; every drive is stopped, and lets go.

        Raises:
            ConfigError: The drives are on another bus.
            RigError: The path is not free.
        """
        super().__init__(plant, drives, lock_step, say)
        self.nodes = tuple(SimulatedMoteus(plant, drives, joint) for joint in range(len(drives.each)))
        self._by_number = {node.number: node for node in self.nodes}
        self._asker, self._is_in_use = -1, True
        self._adapter = SimulatedFdcanusb(drives.table(MoteusBus).path)

    @property
    def where(self) -> str:
        """Address of the bus in readable form."""
        return f"fdcanusb at {self._adapter.path}"

    def cut(self) -> None:
        """Disconnect the cable to the host."""
        super().cut()
        self._adapter.is_cut = True

    def mend(self) -> None:
        """Connect the cable to the host again; frames sent in the meantime are lost."""
        super().mend()
        self._adapter.is_cut = False

    def _close(self) -> None:
        self._adapter.close()

    def _serve(self, seconds: float) -> None:
        for number, data in self._adapter.frames(seconds):
            self._hear(number, data)

    def _hear(self, number: int, data: bytes) -> None:
        node, asker = self._by_number.get(number & NUMBER), number >> 8 & NUMBER
        wants = bool(number & ANSWER_WANTED)
        if self._lock_step and wants and data and data[0] & 0xF0 == READ and asker != self._asker:
            self._asker = asker
            self._step_loop()
        if node is None or not data or not self._is_plugged(node.joint):
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

    def _step_drive(self, joint: int) -> None:
        self.nodes[joint].step(self.plant.twin.period_s, self.plant.now)
