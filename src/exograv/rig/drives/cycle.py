"""Period on a bus whose drives answer separately: a question, the answers, and an order to each drive."""

import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Sequence
from typing import Generic, Protocol, TypeVar, runtime_checkable

from exograv.errors import RigError
from exograv.rig.drive_status import DriveFault

from .node import AskedNode

LISTEN_S = 0.1
"""Time to listen for other hosts before the first frame is sent [s].

A host repeats its frames every few milliseconds.
"""

FRAMES_AT_ONCE = 64
"""Largest number of frames that are processed before a question, and as many as its answers.

At 1 Mbit/s the wire carries some 20 frames in 1 ms; a flood must not delay the tick.
"""

AnyNode = TypeVar("AnyNode", bound=AskedNode)
AnyFrame = TypeVar("AnyFrame", bound=tuple[int, bytes])
HeardFrame = TypeVar("HeardFrame", bound=tuple[int, bytes], covariant=True)


@runtime_checkable
class FrameLink(Protocol[HeardFrame]):
    """Adapter of a bus. Failures in the loop are counted and look like silence; no exception is raised there."""

    counts: Counter[str]
    """Number of frames that were not sent or not received, by reason."""

    def receive(self, until: float) -> HeardFrame | None:
        """Return the next frame, waiting or arriving before `until` on `time.monotonic`; None if there is none."""
        ...

    def close(self) -> None:
        """Close the bus adapter."""
        ...


class Cycle(ABC, Generic[AnyFrame, AnyNode]):
    """Frames of one machine.

    Each bus defines how to send a question, which drive sent a frame, and what the frame contains.
    """

    def __init__(self, link: FrameLink[AnyFrame], nodes: Sequence[AnyNode]):
        """Send nothing yet; the nodes are in the order of the joints."""
        self._frames, self._nodes = link, tuple(nodes)
        self._is_open = False
        """True while answers are expected."""

    def ask(self, answer_s: float) -> bool:
        """Ask every drive; return True if each drive that is not silent answers within `answer_s` [s]."""
        self.listen()
        for node in self._nodes:
            node.ask()
        self._is_open, until = True, time.monotonic() + answer_s
        self._send_question()
        for _ in range(FRAMES_AT_ONCE):
            if self._is_complete() or (frame := self._frames.receive(until)) is None:
                break
            self._hear(frame)
        self._is_open, is_complete = False, self._is_complete()
        for node in self._nodes:
            node.close()
        return is_complete

    def listen(self) -> None:
        """Process the frames that have already arrived, at most `FRAMES_AT_ONCE`."""
        for _ in range(FRAMES_AT_ONCE):
            if (frame := self._frames.receive(0.0)) is None:
                return
            self._hear(frame)

    def refuse_others(self) -> None:
        """Listen before the first frame is sent.

        Raises:
            RigError: Another host is on the bus.
        """
        until = time.monotonic() + LISTEN_S
        while time.monotonic() < until and (frame := self._frames.receive(until)) is not None:
            if self._is_of_another_host(frame):
                self._hear(frame)
                raise RigError(
                    f"Another host commands on this bus: frame 0x{frame[0]:04x} arrived before this program sent any. "
                    "End that program (or the drive maker's tool) first; two hosts would command the motors in turn."
                )

    @abstractmethod
    def tell(self, orders: Sequence[bytes]) -> None:
        """Send one order to each drive."""

    @abstractmethod
    def _send_question(self) -> None:
        """Send the question of this period to all drives."""

    @abstractmethod
    def _is_of_another_host(self, frame: AnyFrame) -> bool:
        """Return True for a frame that only a host of these drives sends, or that answers such a frame."""

    @abstractmethod
    def _take(self, frame: AnyFrame) -> None:
        """Hand a frame to the drive that sent it."""

    def _is_complete(self) -> bool:
        return not any(node.is_awaited for node in self._nodes)

    def _hear(self, frame: AnyFrame) -> None:
        if self._is_of_another_host(frame):
            for node in self._nodes:
                node.hold_against(DriveFault.OTHER_MASTER)
        else:
            self._take(frame)
