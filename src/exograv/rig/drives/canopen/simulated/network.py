"""Simulated drives of a machine on one CAN bus, in one loop without threads."""

import time
from collections.abc import Callable

from exograv.rig.drives.canopen.bus import NO_FRAME, Bus, CanFrame, require_can
from exograv.rig.drives.settings import CanopenBus, Drives
from exograv.rig.drives.simulated.devices import AT_ONCE, Say, SimulatedDevices
from exograv.rig.drives.simulated.plant import Plant

from .node import QuietNetwork, SimulatedNode

KIND = 0x780
"""Bits of a frame's number that give its kind; the others are a node's number, 0 in SYNC and NMT."""

ORDER_BYTES, QUESTION_BYTES = 2, 8
"""Sizes of NMT and SDO frames [byte]; shorter frames are ignored."""


class CanopenDevices(SimulatedDevices):
    """Nodes on the bus of `drives.toml`; each reports that it has started."""

    def __init__(
        self,
        plant: Plant,
        drives: Drives,
        lock_step: bool = False,
        say: Say = print,
        without: frozenset[int] = frozenset(),
    ):
        """Open the bus; `without` are indices of objects that these drives lack.

        Raises:
            ConfigError: The drives are on another bus.
            RigError: The adapter does not open.
        """
        super().__init__(plant, drives, lock_step, say)
        require_can()
        self._settings = drives.table(CanopenBus)
        self._bus = Bus(self._settings)
        self._handlers = {
            0x000: self._on_order,
            0x080: self._on_sync,
            0x200: self._on_command,
            0x600: self._on_question,
            0x700: self._on_heartbeat,
        }
        self._network = QuietNetwork(self._send)
        self._joints = {drive.node: joint for joint, drive in enumerate(drives.each)}
        self.nodes = tuple(
            SimulatedNode(plant, joint, self._sender(joint), without) for joint in range(len(drives.each))
        )
        for node in self.nodes:
            self._join(node)
        self.watch: Callable[[float, float], object] | None = None
        """Callback for examiners: reception and end of the answer of each SYNC, on the monotonic clock [s]."""

    @property
    def where(self) -> str:
        """Address of the bus in readable form."""
        return f"can://{self._settings.interface}/{self._settings.channel}"

    def restart(self, joint: int) -> None:
        """Switch a drive's power off and on; it loses its settings."""
        node = self.nodes[joint]
        del self._network[node.number]
        node.restart()
        self._join(node)

    def _join(self, node: SimulatedNode) -> None:
        self._network[node.number] = node.local
        node.local.nmt.state = "INITIALISING"
        node.local.nmt.state = "PRE-OPERATIONAL"

    def _close(self) -> None:
        self._bus.close()

    def _serve(self, seconds: float) -> None:
        until = time.monotonic() + seconds
        for _ in range(AT_ONCE):
            if (frame := self._bus.receive(until)) is None:
                return
            if frame is NO_FRAME:
                continue
            handler = self._handlers.get(frame.cob & KIND)
            if handler is not None:
                handler(frame, self.plant.now)
            until = 0.0

    def _on_order(self, frame: CanFrame, now: float) -> None:
        if len(frame.data) != ORDER_BYTES:
            return
        for node in self._plugged():
            node.local.nmt.on_command(frame.cob, frame.data, now)
            node.order(node.local.nmt.state)

    def _on_sync(self, frame: CanFrame, now: float) -> None:
        if frame.cob & ~KIND:
            return  # an emergency frame
        heard_at = time.monotonic()
        self._note_question()
        # On a wire the lowest number has priority: a slow frame does not come before another drive's measurement.
        for cob, data in sorted(frame for node in self._plugged() for frame in node.on_sync(now)):
            self._bus.send(cob, data)
        if self.watch is not None:
            self.watch(heard_at, time.monotonic())
        if self._lock_step:
            self._step_loop()

    def _on_command(self, frame: CanFrame, now: float) -> None:
        for node in self._plugged():
            if node.received is not None and node.received.cob == frame.cob:
                node.on_command(frame.data, now)

    def _on_question(self, frame: CanFrame, now: float) -> None:
        if len(frame.data) == QUESTION_BYTES and self._hears(frame.cob & ~KIND):
            self._network.notify(frame.cob, bytearray(frame.data), now)

    def _on_heartbeat(self, frame: CanFrame, now: float) -> None:
        for node in self._plugged():
            node.on_heartbeat(frame.cob & ~KIND, now)

    def _step_drive(self, joint: int) -> None:
        self.nodes[joint].step(self.plant.now)

    def _plugged(self) -> list[SimulatedNode]:
        return [node for joint, node in enumerate(self.nodes) if self._is_plugged(joint)]

    def _hears(self, number: int) -> bool:
        return number not in self._joints or self._is_plugged(self._joints[number])

    def _sender(self, joint: int) -> Callable[[int, bytes], None]:
        def send(cob: int, data: bytes) -> None:
            if self._is_plugged(joint):
                self._bus.send(cob, data)

        return send

    def _send(self, cob: int, data: bytes) -> None:
        """Send a frame of the package `canopen` for a node: an answer, or its boot-up message."""
        if self._hears(cob & 0x7F):
            self._bus.send(cob, data)
