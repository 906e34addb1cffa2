"""What goes over the bus in one period: a question to each moteus, its answer, and an order to each."""

import time
from collections.abc import Callable, Sequence

from exograv.rig.drive_status import DriveFault

from .fdcanusb import CanFdFrame, Fdcanusb, head, line
from .frames import QUESTION, answer
from .node import MoteusNode

BROADCAST = 0x7F
OURS = 32
"""Numbers under which we ask, one a tick in turn: an answer goes to the number that asked, and so tells to which tick
it belongs. Answers of a moteus carry nothing else that would."""


class MoteusCycle:
    """Of one machine."""

    def __init__(self, link: Fdcanusb, nodes: Sequence[MoteusNode]):
        """Nothing is sent."""
        self._link, self._nodes = link, tuple(nodes)
        numbers = [node.drive.node for node in nodes]
        self._by_number = dict(zip(numbers, nodes, strict=True))
        self.ours = own_numbers(numbers)
        """Highest first; the first is also that of orders."""
        self._questions = [
            b"".join(line(head(number, own, wants_answer=True), QUESTION) for number in numbers) for own in self.ours
        ]
        self._tick, self._is_open, self._own = 0, False, frozenset(self.ours)
        self.late = 0
        """Answers that came when their tick was over."""

    def ask(self, answer_s: float) -> bool:
        """One question to each; whether every one that is not silent has answered it within so long [s]."""
        self.listen()
        self._tick = (self._tick + 1) % OURS
        for node in self._nodes:
            node.ask()
        self._is_open, until = True, time.monotonic() + answer_s
        self._link.send(self._questions[self._tick])
        while not (is_complete := self._is_complete()):
            frame = self._link.receive(until)
            if frame is None:
                break
            self._hear(frame)
        self._is_open = False
        for node in self._nodes:
            node.close()
        return is_complete

    def tell(self, orders: Sequence[bytes]) -> None:
        """One order to each."""
        self._link.send(b"".join(orders))

    def listen(self, seconds: float = 0.0, told: Callable[[CanFdFrame], None] = lambda frame: None) -> None:
        """Take what is on the bus, waiting so long for more."""
        until = time.monotonic() + seconds
        while (frame := self._link.receive(until)) is not None:
            self._hear(frame)
            if self.is_of_another_master(frame):
                told(frame)

    def is_of_another_master(self, frame: CanFdFrame) -> bool:
        """Whether it commands one of our drives, or is the answer of one to somebody else."""
        by_number = self._by_number
        if frame.destination in by_number or frame.destination == BROADCAST:
            return True
        return frame.source in by_number and frame.destination not in self._own

    def _is_complete(self) -> bool:
        return all(node.has_answered or node.is_silent for node in self._nodes)

    def _hear(self, frame: CanFdFrame) -> None:
        if self.is_of_another_master(frame):
            for node in self._nodes:
                node.hold_against(DriveFault.OTHER_MASTER)
            return
        node = self._by_number.get(frame.source)
        if node is None:
            return
        if not self._is_open or frame.destination != self.ours[self._tick]:
            self.late += 1
            node.lives()
        elif (said := answer(frame.data)) is not None:
            node.answer(said)


def own_numbers(taken: Sequence[int]) -> tuple[int, ...]:
    """Of the 7 bits that a frame has for who sends it, none of a drive."""
    free = [number for number in range(BROADCAST - 1, 0, -1) if number not in taken]
    return tuple(free[:OURS])
