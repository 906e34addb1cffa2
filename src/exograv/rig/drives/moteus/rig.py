"""Driver of a machine of moteus controllers, which are asked once per period by this computer's clock."""

from collections.abc import Sequence
from typing import ClassVar

from moteus import Register

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.bus_load import refuse_overload
from exograv.rig.drives.nodes_driver import NodesDriver
from exograv.rig.drives.settings import Drives, MoteusBus
from exograv.signals import Command

from .cycle import MoteusCycle, load
from .diagnostic import Diagnostic
from .fdcanusb import Fdcanusb
from .modes import POWERLESS
from .nameplate import read_plate
from .node import MoteusNode

NUMBER_MOST = 126


class MoteusRig(NodesDriver[MoteusNode, Fdcanusb]):
    """Driver whose `read` asks every drive and waits for the answers, and whose `write` sends a torque to each.

    Questions and answers of four drives take 0.8 ms of the wire's time.
    """

    first_answer_s: ClassVar[float] = 0.1
    not_open: ClassVar[str] = "The adapter is not open. Use the machine inside `with rig:`."

    def __init__(self, drives: Drives, answer_s: float | None = None, lock_step: bool = False):
        """Open nothing yet; arguments as `Driver`.

        Raises:
            ConfigError: The drives are on another bus, one has the broadcast number, or their frames do not fit on the
                wire.
        """
        self._path = drives.table(MoteusBus).path
        if (most := max(drive.node for drive in drives.each)) > NUMBER_MOST:
            raise ConfigError(
                f"node {most} addresses all drives at once on this bus. Use numbers from 1 to {NUMBER_MOST}."
            )
        refuse_overload(drives, load(drives))
        super().__init__(drives, [MoteusNode(drive) for drive in drives.each], answer_s, lock_step)
        self._was_on = False

    def disable(self) -> None:
        """Switch all motors off; their drives brake. A drive that was never enabled gets no command."""
        for _ in range(3 if self._was_on else 0):  # an order may be lost; the watchdog acts if all are
            super().disable()

    def _opened(self) -> Fdcanusb:
        self._was_on = False
        return Fdcanusb(self._path)

    def _cycle_on(self, link: Fdcanusb) -> MoteusCycle:
        cycle = MoteusCycle(link, self._nodes)
        self._source = cycle.ours[0]
        return cycle

    def _configure(self, nodes: Sequence[MoteusNode], link: Fdcanusb) -> None:
        for node in nodes:
            asked = Diagnostic(link, node.drive.joint, node.drive.node, self._source)
            node.set_up(read_plate(asked, node.drive, self._drives), self._source, self._drives.watchdog_s)
            mode = asked.register(Register.MODE, is_short=True)
            if mode not in POWERLESS:
                raise RigError(
                    f"The moteus of {node.drive.joint} (id {node.drive.node}) is on already, in mode {mode}, but no "
                    f"host commands it. Switch it off: moteus_tool -t {node.drive.node} --stop; then start again."
                )

    def _tell(self, command: Command, currents: list[float], damping: list[float]) -> None:
        if self._is_on:  # a drive that was never on gets no order, not even to brake
            super()._tell(command, currents, damping)

    def _switch_on(self) -> None:
        self._was_on = True
        super()._switch_on()
