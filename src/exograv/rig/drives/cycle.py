"""One period on a bus on which each drive answers for itself: a question, the answers, and an order to each."""

import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from typing import Generic, Protocol, TypeVar, runtime_checkable

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault

from .node import AskedNode

LISTEN_S = 0.1
"""Time for which other hosts are listened for before anything is said: a host cycles in milliseconds [s]."""

AnyNode = TypeVar("AnyNode", bound=AskedNode)
AnyFrame = TypeVar("AnyFrame", bound=tuple[int, bytes])
HeardFrame = TypeVar("HeardFrame", bound=tuple[int, bytes], covariant=True)


@runtime_checkable
class FrameLink(Protocol[HeardFrame]):
    """Adapter of a bus. A failure in the loop is counted and becomes silence: nothing is raised there."""

    counts: Counter[str]
    """Frames that were not sent or not received, by reason."""

    def receive(self, until: float) -> HeardFrame | None:
        """Next frame of another participant that comes until then, on `time.monotonic`, or has come already."""
        ...

    def close(self) -> None:
        """Give the adapter back."""
        ...


class Cycle(ABC, Generic[AnyFrame, AnyNode]):
    """Frames of one machine. A bus adds how a question is sent, whose a frame is, and what it says."""

    def __init__(self, link: FrameLink[AnyFrame], nodes: Sequence[AnyNode]):
        """Send nothing yet; the nodes are in the order of the joints."""
        self._frames, self._nodes = link, tuple(nodes)
        self._is_open = False
        """True while answers are waited for."""

    def ask(self, answer_s: float) -> bool:
        """Ask every drive; True if each that is not silent answers within so long [s]."""
        self.listen()
        for node in self._nodes:
            node.ask()
        self._is_open, until = True, time.monotonic() + answer_s
        self._send_question()
        while not (is_complete := all(node.has_answered or node.is_silent for node in self._nodes)):
            frame = self._frames.receive(until)
            if frame is None:
                break
            self._hear(frame)
        self._is_open = False
        for node in self._nodes:
            node.close()
        return is_complete

    def listen(self) -> None:
        """Take what has come already."""
        while (frame := self._frames.receive(0.0)) is not None:
            self._hear(frame)

    def refuse_others(self) -> None:
        """Listen before anything is said.

        Raises:
            RigError: Another host is heard.
        """
        until = time.monotonic() + LISTEN_S
        while (frame := self._frames.receive(until)) is not None:
            if self._is_of_another_host(frame):
                self._hear(frame)
                raise RigError(
                    f"Another host commands on this bus: frame 0x{frame[0]:04x} was heard before anything was said. "
                    "End that program (or the drive maker's tool) first; two hosts would take turns with the motors."
                )

    @abstractmethod
    def tell(self, orders: Sequence[bytes]) -> None:
        """Send one order to each drive."""

    @abstractmethod
    def _send_question(self) -> None:
        """Ask all drives."""

    @abstractmethod
    def _is_of_another_host(self, frame: AnyFrame) -> bool:
        """True for a frame that only a host of these drives sends, or is answered with."""

    @abstractmethod
    def _take(self, frame: AnyFrame) -> None:
        """Hand a frame to the drive that said it."""

    def _hear(self, frame: AnyFrame) -> None:
        if self._is_of_another_host(frame):
            for node in self._nodes:
                node.hold_against(DriveFault.OTHER_MASTER)
        else:
            self._take(frame)
