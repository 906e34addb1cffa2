"""Questions and answers (SDO) with drives through the package `canopen`, only while no drive is enabled."""

import contextlib
import logging
import struct
from collections.abc import Iterator

from exograv.errors import RigError
from exograv.rig.drives.settings import Drive

from .bus import Bus
from .objects import Entry

ANSWER_S = 0.5
"""Time-out for an answer of a drive [s]."""


class SdoNode:
    """SDO access to one drive."""

    def __init__(self, drive: Drive, sdo, aborted: type[Exception], error: type[Exception]):
        self._drive, self._sdo, self._aborted, self._error = drive, sdo, aborted, error

    def read(self, entry: Entry) -> int | None:
        """Return the value of an object; None if the drive lacks the object.

        Raises:
            RigError: The drive does not answer.
        """
        try:
            data = self._sdo.upload(entry.index, entry.sub)
        except self._aborted:
            return None
        except self._error as error:
            raise self._silent(entry) from error
        layout = struct.Struct("<" + entry.format)
        # Some drives answer with more bytes than their dictionary says.
        return layout.unpack(bytes(data)[: layout.size].ljust(layout.size, b"\0"))[0]

    def write(self, entry: Entry, value: int) -> bool:
        """Write an object; return True if the drive has it and holds the value afterwards.

        Raises:
            RigError: The drive does not answer.
        """
        try:
            self._sdo.download(entry.index, entry.sub, struct.pack("<" + entry.format, value))
        except self._aborted:
            return False
        except self._error as error:
            raise self._silent(entry) from error
        return self.read(entry) == value

    def _silent(self, entry: Entry) -> RigError:
        return RigError(
            f"The drive of {self._drive.joint} (node {self._drive.node}) does not answer when asked for {entry}. Is it "
            "on, is its node number and bit rate right, and is the bus terminated with 120 Ω at both ends?"
        )


@contextlib.contextmanager
def asking(bus: Bus, drives: tuple[Drive, ...]) -> Iterator[dict[str, SdoNode]]:
    """Yield SDO access to each drive by joint. A thread of `canopen` reads the bus until the context ends."""
    import can
    import canopen

    class Network(canopen.Network):
        def send_message(self, can_id: int, data: bytes | bytearray | list[int], remote: bool = False) -> None:
            bus.send(can_id, bytes(data))

    network = Network(bus.adapter)
    # This module reports retries and aborts to the user itself, in a sentence.
    logging.getLogger("canopen").setLevel(logging.CRITICAL)
    network.notifier = can.Notifier(bus.adapter, network.listeners, timeout=0.02)
    try:
        asked = {}
        for drive in drives:
            sdo = network.add_node(drive.node, canopen.ObjectDictionary()).sdo
            sdo.RESPONSE_TIMEOUT = ANSWER_S
            asked[drive.joint] = SdoNode(drive, sdo, canopen.SdoAbortedError, canopen.SdoCommunicationError)
        yield asked
    finally:
        network.notifier.stop()
