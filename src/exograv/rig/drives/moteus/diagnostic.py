"""Diagnostic stream of one moteus: a line to the drive and its answer, only while no drive is switched on."""

import time
from collections.abc import Callable

from moteus import INT8, INT32, Controller, parse_registers

from exograv.errors import RigError

from .fdcanusb import CanFdFrame, Fdcanusb, head, line

PIECE = 61
"""Bytes of text in a frame of 64 bytes."""

FRAME_S, ANSWER_S = 0.1, 1.0
"""Time-outs for one frame and for a whole answer [s]."""

PAUSE_S = 0.001
EMPTY = 2
"""Number of empty answers in a row after which older answers have all been read."""


class Diagnostic:
    """Diagnostic stream of one drive."""

    def __init__(self, link: Fdcanusb, joint: str, number: int, source: int):
        self.link, self.joint, self.number, self._source = link, joint, number, source
        self._controller = Controller(id=number)
        self._heard = b""

    def flush(self) -> None:
        """Discard answers to earlier requests of other programs.

        Raises:
            RigError: The drive does not answer.
        """
        empty, ends = 0, time.monotonic() + ANSWER_S
        while empty < EMPTY and time.monotonic() < ends:
            empty = 0 if self._poll() else empty + 1
        self._heard = b""

    def setting(self, name: str) -> float | None:
        """Return the value of a setting; None if the drive lacks the setting.

        Raises:
            RigError: The drive does not answer, or its answer is not a number.
        """
        said = self._ask(f"conf get {name}")
        if said is None:
            return None
        try:
            return float(said)
        except ValueError as error:
            raise RigError(f"{self._who} reports {name} = '{said}', which is not a number. Is it a moteus?") from error

    def register(self, register: int, is_short: bool = False) -> int:
        """Return a register of whole numbers.

        Raises:
            RigError: The drive does not answer.
        """
        asked = self._controller.make_custom_query({register: INT8 if is_short else INT32})
        frame = self._exchange(asked.data, _is_of_registers)
        found = parse_registers(frame.data).response
        if register not in found:
            raise RigError(f"{self._who} does not report its register 0x{register:03x}. Update its firmware.")
        return int(found[register])

    @property
    def _who(self) -> str:
        return f"The moteus of {self.joint} (id {self.number})"

    def _ask(self, text: str) -> str | None:
        """Return the drive's one-line answer; None if it answers with an error."""
        data = text.encode() + b"\n"
        for k in range(0, len(data), PIECE):
            told = self._controller.make_diagnostic_write(data=data[k : k + PIECE])
            self.link.send(line(head(self.number, self._source, wants_answer=False), told.data))
        said, ends = "", time.monotonic() + ANSWER_S
        while time.monotonic() < ends:
            text = self._line(ends)
            if text.startswith("ERR"):
                return None
            if text == "OK":
                return said
            said = text or said
        raise RigError(f"{self._who} does not answer on its diagnostic stream. Does another program use it?")

    def _line(self, ends: float) -> str:
        while b"\n" not in self._heard and time.monotonic() < ends:
            if not self._poll():
                time.sleep(PAUSE_S)
        text, _, self._heard = self._heard.partition(b"\n")
        return text.decode("latin-1").strip()

    def _poll(self) -> bool:
        """Read the stream once; return True if it contained text."""
        asked = self._controller.make_diagnostic_read()
        frame = self._exchange(asked.data, _is_of_stream)
        said = asked.parse(frame).data or b""
        self._heard += said
        return bool(said)

    def _exchange(self, data: bytes, is_answer: Callable[[bytes], bool]) -> CanFdFrame:
        for _ in range(3):  # a frame may be lost
            self.link.send(line(head(self.number, self._source, wants_answer=True), data))
            ends = time.monotonic() + FRAME_S
            while (frame := self.link.receive(ends)) is not None:
                if (frame.source, frame.destination) == (self.number, self._source) and is_answer(frame.data):
                    return frame
        complaint = f" The adapter reports '{self.link.error}'." if self.link.error else ""
        raise RigError(
            f"{self._who} does not answer.{complaint} Does it have power, is it on this bus, and is its id.id "
            f"{self.number}?"
        )


def _is_of_registers(data: bytes) -> bool:
    """Return True for register values, or for the answer that the register does not exist."""
    return bool(data) and (data[0] & 0xF0 == 0x20 or data[0] == 0x31)


def _is_of_stream(data: bytes) -> bool:
    return bool(data) and data[0] == 0x41
