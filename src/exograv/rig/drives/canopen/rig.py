"""Driver of a machine of CiA 402 drives.

The host sends SYNC in every period. At SYNC each drive measures, and takes its command. Without commands the drive's
watchdog brakes.
"""

from collections.abc import Sequence
from typing import ClassVar

from exograv.errors import ConfigError
from exograv.rig.drives.bus_load import refuse_overload
from exograv.rig.drives.nodes_driver import NodesDriver
from exograv.rig.drives.settings import CanopenBus, Drives

from .bus import Bus
from .configuration import configure
from .cycle import CanopenCycle, load
from .network import asking
from .node import CanopenNode
from .objects import MASTER, Nmt

WITHOUT_WIRE = ("udp_multicast", "virtual")
"""Adapters without a wire, which are as fast as this computer."""


class CanopenRig(NodesDriver[CanopenNode, Bus]):
    """Driver whose `read` sends the SYNC and waits for its answers, and whose `write` sends a torque to each drive.

    At 1 Mbit/s the SYNC and eight frames of four drives take up to 0.97 ms of a period of 2 ms (docs/howto/canopen.md).
    """

    not_open: ClassVar[str] = "The CAN bus is not open. Use the machine inside `with rig:`."
    no_answer: ClassVar[str] = (
        "Does the drive send its PDOs with SYNC (transmission type 1)? docs/howto/canopen.md lists what it has to "
        "support."
    )

    def __init__(self, drives: Drives, answer_s: float | None = None, lock_step: bool = False):
        """Open nothing yet; arguments as `Driver`.

        Raises:
            ConfigError: The drives are on another bus, a drive has the host's number, or their frames do not fit on
                the wire.
        """
        self._settings = drives.table(CanopenBus)
        if any(drive.node == MASTER for drive in drives.each):
            raise ConfigError(
                f"Node {MASTER} is the host's own number on the bus. Give that drive another number, 1 to {MASTER - 1}."
            )
        if self._settings.interface not in WITHOUT_WIRE:
            refuse_overload(drives, load(drives))
        has_motor = drives.rad_per_motor_count is not None
        nodes = [CanopenNode(drive, has_motor, drives.period_s) for drive in drives.each]
        super().__init__(drives, nodes, answer_s, lock_step)
        self.notes: tuple[str, ...] = ()
        """Sentences about functions that the drives lack."""

    def _opened(self) -> Bus:
        return Bus(self._settings)

    def _cycle_on(self, link: Bus) -> CanopenCycle:
        self._frames = CanopenCycle(link, self._nodes, self._drives)
        return self._frames

    def _configure(self, nodes: Sequence[CanopenNode], link: Bus) -> None:
        self._frames.order(Nmt.PRE_OPERATIONAL, nodes)
        with asking(link, tuple(node.drive for node in nodes)) as asked:
            notes = [note for node in nodes for note in configure(self._drives, node, asked[node.drive.joint])]
        self.notes = (*self.notes, *(note for note in notes if note not in self.notes))
        for node in nodes:
            node.start()
        self._frames.listen()
        self._frames.order(Nmt.START, nodes)

    def _refresh(self) -> None:
        self.disable()
        super()._refresh()

    def _leave(self) -> None:
        self.disable()
        self._frames.ask(self._answer_s)
        self.disable()
        self._frames.leave()
