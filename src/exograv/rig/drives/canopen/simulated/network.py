"""All simulated drives of a machine on one CAN bus, in one loop without threads: for another process than the master's.

Real time steps the plant by the wall clock, whoever talks or not; lock-step steps it by one loop period with each SYNC.
"""

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from exograv.errors import RigError
from exograv.rig.drives.canopen.bus import Bus, CanFrame, require_can
from exograv.rig.drives.settings import Drives
from exograv.rig.drives.simulated.plant import Plant

if TYPE_CHECKING:
    from .node import SimulatedNode

STALL_S = 0.005
"""A pause of this process from which on its clock is set anew: real drives do not pause, so their time stands still."""

KIND = 0x780
"""Bits of a frame's number that say what it is; the others are a node's, 0 in SYNC and NMT."""

ORDER_BYTES, QUESTION_BYTES = 2, 8
"""Of NMT and SDO; what is shorter is no frame of theirs."""

LISTEN_S = 0.02
"""Between two looks at whether to stop, in lock-step."""


class CanopenDevices:
    """The bus end of a plant; a context manager, which owns the bus."""

    def __init__(
        self,
        plant: Plant,
        drives: Drives,
        lock_step: bool = False,
        without: frozenset[int] = frozenset(),
        say: Callable[[str], object] = print,
    ):
        """Open the bus of `drives.toml`; every drive says that it has started.

        Args:
            plant: What moves.
            drives: As the machine's `drives.toml` says.
            lock_step: Whether time goes with the SYNCs.
            without: Objects by index that these drives have not.
            say: Takes a line for each event.

        Raises:
            RigError: These drives are on another bus.
        """
        if drives.settings.canopen is None:
            raise RigError("These drives are not on a CAN bus: drives.toml has no [canopen].")
        require_can()
        from .node import QuietNetwork, SimulatedNode

        self.plant, self._drives, self._lock_step, self._say = plant, drives, lock_step, say
        self._settings = drives.settings.canopen
        self._bus = Bus(self._settings)
        self._unplugged: set[int] = set()
        self._handlers = {
            0x000: self._on_order,
            0x080: self._on_sync,
            0x200: self._on_command,
            0x600: self._on_question,
            0x700: self._on_heartbeat,
        }
        self._network = QuietNetwork(self._send)
        self.nodes = tuple(
            SimulatedNode(plant, joint, self._sender(drive.node), without) for joint, drive in enumerate(drives.each)
        )
        for node in self.nodes:
            self._join(node)
        self._faults = [node.drive.fault for node in self.nodes]
        self._steps_a_sync = round(drives.period_s / plant.twin.period_s)
        self.watch: Callable[[float, float], object] | None = None
        """For examiners: is told of each SYNC when it was heard and when it had been answered, monotonic [s]."""
        self.longest_pause_s = 0.0
        """That this process made, beyond its period [s]."""
        self.pauses: list[tuple[float, float]] = []
        """Each pause of `STALL_S` or more: when it ended by the monotonic clock, and how long it was [s]."""

    def __enter__(self) -> "CanopenDevices":
        return self

    def __exit__(self, *_: object) -> None:
        self._bus.close()

    def run(self, until_stopped: Callable[[], bool]) -> None:
        """Serve the bus until told to stop, which is asked once a step."""
        if self._lock_step:
            while not until_stopped():
                wait_s = LISTEN_S
                while (frame := self._bus.receive(wait_s)) is not None:
                    self._hear(frame)
                    wait_s = 0.0
            return
        due = time.monotonic() + self.plant.twin.period_s
        while not until_stopped():
            self._serve(due)
            behind = time.monotonic() - due
            self.longest_pause_s = max(self.longest_pause_s, behind)
            if behind > STALL_S:
                self.pauses.append((due + behind, behind))
                due += behind
                self._serve(due)  # what was told meanwhile is heard before any time passes here
            self._step()
            due += self.plant.twin.period_s

    @property
    def where(self) -> str:
        """Its address, for people."""
        return f"can://{self._settings.interface}/{self._settings.channel}"

    def unplug(self, joint: int) -> None:
        """Take this drive's plug out of the bus; it keeps its power."""
        self._unplugged.add(self.nodes[joint].number)

    def plug(self, joint: int) -> None:
        """Put it back."""
        self._unplugged.discard(self.nodes[joint].number)

    def cut(self) -> None:
        """The cable to the host is out."""
        self._unplugged.update(node.number for node in self.nodes)

    def mend(self) -> None:
        """It is in again."""
        self._unplugged.clear()

    def restart(self, joint: int) -> None:
        """Take its power, and give it back: it has forgotten what it was set to."""
        node = self.nodes[joint]
        del self._network[node.number]
        node.restart()
        self._join(node)

    def _join(self, node: "SimulatedNode") -> None:
        self._network[node.number] = node.local
        node.local.nmt.state = "INITIALISING"
        node.local.nmt.state = "PRE-OPERATIONAL"

    def _serve(self, until: float) -> None:
        """Answer what comes, and what has come already."""
        while (frame := self._bus.receive(until - time.monotonic())) is not None:
            self._hear(frame)

    def _hear(self, frame: CanFrame) -> None:
        handler = self._handlers.get(frame.cob & KIND)
        if handler is not None:
            handler(frame, self.plant.now)

    def _on_order(self, frame: CanFrame, now: float) -> None:
        if len(frame.data) != ORDER_BYTES:
            return
        for node in self._plugged():
            node.local.nmt.on_command(frame.cob, frame.data, now)
            node.order(node.local.nmt.state)

    def _on_sync(self, frame: CanFrame, now: float) -> None:
        if frame.cob & ~KIND:
            return  # somebody's emergency
        heard_at = time.monotonic()
        # On a wire the lowest number goes first: what is slow does not come before another drive's measurement.
        for cob, data in sorted(frame for node in self._plugged() for frame in node.on_sync(now)):
            self._bus.send(cob, data)
        if self.watch is not None:
            self.watch(heard_at, time.monotonic())
        if self._lock_step:
            for _ in range(self._steps_a_sync):
                self._step()

    def _on_command(self, frame: CanFrame, now: float) -> None:
        for node in self._plugged():
            if node.received is not None and node.received.cob == frame.cob:
                node.on_command(frame.data, now)

    def _on_question(self, frame: CanFrame, now: float) -> None:
        if len(frame.data) == QUESTION_BYTES and frame.cob & ~KIND not in self._unplugged:
            self._network.notify(frame.cob, bytearray(frame.data), now)

    def _on_heartbeat(self, frame: CanFrame, now: float) -> None:
        for node in self._plugged():
            node.on_heartbeat(frame.cob & ~KIND, now)

    def _step(self) -> None:
        self.plant.step()
        now = self.plant.now
        for j, node in enumerate(self.nodes):
            node.step(now)
            if node.drive.fault != self._faults[j]:
                self._faults[j], told_ms = node.drive.fault, 1e3 * (now - node.drive.told_at)
                said = node.drive.fault.name or "no fault"
                self._say(f"{now:.3f} s: {self._drives.joints[j]}: {said}; told last {told_ms:.1f} ms before")

    def _plugged(self) -> list["SimulatedNode"]:
        return [node for node in self.nodes if node.number not in self._unplugged]

    def _sender(self, number: int) -> Callable[[int, bytes], None]:
        def send(cob: int, data: bytes) -> None:
            if number not in self._unplugged:
                self._bus.send(cob, data)

        return send

    def _send(self, cob: int, data: bytes) -> None:
        """What the package `canopen` says for a node: answers, and that it has started."""
        if cob & 0x7F not in self._unplugged:
            self._bus.send(cob, data)
