"""Frames of one period on the bus: a question to each moteus, its answer, and an order to each."""

from collections.abc import Sequence

from exograv.rig.drives.bus_load import fd_frame_s
from exograv.rig.drives.cycle import Cycle
from exograv.rig.drives.settings import Drives

from .fdcanusb import CanFdFrame, Fdcanusb, head, line
from .frames import QUESTION, answer
from .node import MoteusNode

BROADCAST = 0x7F
OURS = 32
"""Number of node numbers from which the host asks, one per tick in turn.

An answer goes to the number that asked, and thus shows its tick. Nothing else in a moteus's answer does.
"""

FRAMES_BYTES = (8, 20, 48)
"""Sizes of question, answer and order, filled up [byte]."""


class MoteusCycle(Cycle[CanFdFrame, MoteusNode]):
    """Frames of one machine. Answers that arrive after the end of their tick are counted as late."""

    def __init__(self, link: Fdcanusb, nodes: Sequence[MoteusNode]):
        super().__init__(link, nodes)
        self._link, self._tick = link, 0
        numbers = [node.drive.node for node in nodes]
        self._by_number = dict(zip(numbers, nodes, strict=True))
        self.ours = own_numbers(numbers)
        """Node numbers of the host, highest first; the first is also the source of orders."""
        self._own = frozenset(self.ours)
        self._questions = [
            b"".join(line(head(number, own, wants_answer=True), QUESTION) for number in numbers) for own in self.ours
        ]

    def tell(self, orders: Sequence[bytes]) -> None:
        """Send one order to each drive."""
        self._link.send(b"".join(orders))

    def _send_question(self) -> None:
        self._tick = (self._tick + 1) % OURS
        self._link.send(self._questions[self._tick])

    def _is_of_another_host(self, frame: CanFdFrame) -> bool:
        by_number = self._by_number
        if frame.destination in by_number or frame.destination == BROADCAST:
            return True
        return frame.source in by_number and frame.destination not in self._own

    def _take(self, frame: CanFdFrame) -> None:
        node = self._by_number.get(frame.source)
        if node is None:
            return
        if not self._is_open or frame.destination != self.ours[self._tick]:
            self._link.counts["late"] += 1
            node.lives()
        elif (said := answer(frame.data)) is not None:
            node.answer(said)


def own_numbers(taken: Sequence[int]) -> tuple[int, ...]:
    """Node numbers for the host: 7-bit numbers that no drive has."""
    free = [number for number in range(BROADCAST - 1, 0, -1) if number not in taken]
    return tuple(free[:OURS])


def load(drives: Drives) -> float:
    """Share of the wire's time that one period of this machine takes [-]; above 1 it does not fit."""
    return len(drives.each) * sum(map(fd_frame_s, FRAMES_BYTES)) / drives.period_s
