"""Reader of one stream of another device: connects, takes samples and clock corrections, and reconnects.

A connection is one outlet of one process, and so has one clock. LSL could recover a lost stream by itself, but then the
clock of each stamp would not be known.
"""

import ctypes
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.recording.messages import StreamNote
from exograv.recording.stream_block import StreamBlock, packed, packed_size

from .blocks import CORRECTED, CORRECTION_ROW, DATA_BYTES, SAMPLES
from .library import lsl
from .quality import StampWatch, StreamQuality
from .streams import LOOK_S, FoundStream

POLL_S = 0.02
"""Time between two reads of the stream [s]. Samples that LSL still buffers are lost when the device disappears."""

BLOCK_S = 0.1
"""Longest time that samples wait for others of their block [s]."""

CORRECTION_S = 2.0
"""Time between two clock corrections [s]; LSL itself measures that often (`TimeUpdateInterval`)."""

CORRECTION_WITHIN_S = 1.0
"""Longest wait for a clock correction [s]; the first one takes 0.64 s."""

SILENT_S = 2.0
"""Time without a sample after which a stream with a rate is silent, and between two searches for its return [s]."""

KEPT_S = 360
"""Data that LSL keeps if the recorder stands still [s]."""

Hand = Callable[[int, float, bytes], bool]
"""Callback that receives kind, CLOCK_MONOTONIC [s] and data of a block. It returns True if there was room."""

Note = Callable[[StreamNote | StreamQuality], object]


class StreamReader:
    """Reader that runs in its own thread, because the library's calls wait for each device."""

    def __init__(self, found: FoundStream, topic: str, connection: int, hand: Hand, note: Note):
        """Prepare a reader for a stream that was found, with its number of connections so far."""
        self._found, self._topic, self._connection = found, topic, connection
        self._hand, self._note = hand, note
        self._samples = _Samples(found)
        self._uid = ""
        self._watch, self._clock = StampWatch(found.rate_Hz), None

    def run(self, over: threading.Event) -> None:
        """Record until `over` is set."""
        while not over.is_set():
            inlet = self._connected() if self._flush() else None
            if inlet is None:
                over.wait(0.1)
                continue
            try:
                self._listen(inlet, over)
            except _GoneError as gone:
                self._say("lost", f"{self._found.name} is gone ({gone}). The listener looks for it.")
            finally:
                self._flush()
                inlet.close_stream()

    def _connected(self) -> Any:
        """Return an inlet whose stream is open; None if the stream is not there."""
        from pylsl.util import LostError

        there = lsl().resolve_bypred(self._found.predicate, 1, LOOK_S)
        if not there:
            return None
        inlet = lsl().StreamInlet(there[0], KEPT_S, recover=False, as_numpy=True)
        try:
            xml = inlet.info(CORRECTION_WITHIN_S).as_xml()
            self._uid = there[0].uid()
            self._connection += 1
            self._watch, self._clock = StampWatch(self._found.rate_Hz), None
            self._correct(inlet)  # before samples come, because the first correction takes long
            inlet.open_stream(CORRECTION_WITHIN_S)
        except (TimeoutError, LostError):
            return None
        self._say("connected", f"{self._found.name} of {self._found.host} is recorded.", xml=xml)
        return inlet

    def _listen(self, inlet: Any, over: threading.Event) -> None:
        from pylsl.util import LostError

        now = time.monotonic()
        heard, corrected, looked, is_silent = now, now, now, False
        try:
            while not over.wait(POLL_S):
                now = time.monotonic()
                if self._pull(inlet):
                    heard = now
                if is_silent != (self._found.rate_Hz > 0.0 and now - heard > SILENT_S):
                    is_silent = not is_silent
                    self._say(*(SILENT if is_silent else RESUMED))
                if now - heard > SILENT_S and now - looked > SILENT_S:
                    looked = now
                    self._look_elsewhere()
                if now - corrected > CORRECTION_S:
                    corrected = now
                    self._correct(inlet)
                    self._note(self._quality())
            self._pull(inlet)
        except LostError:
            raise _GoneError("its program has closed it or ended") from None

    def _pull(self, inlet: Any) -> bool:
        """Pull samples; return True if some came. Without room for them they stay with LSL."""
        came = False
        while True:
            count = self._samples.pull(inlet)
            self._watch.see(self._samples.newest(count))
            came = came or count > 0
            is_due = self._samples.is_full or time.monotonic() - self._samples.since > BLOCK_S
            if (is_due and not self._flush()) or not count:
                return came

    def _flush(self) -> bool:
        """Hand over the pulled samples if there is room; return True if none is left."""
        if not self._samples.count:
            return True
        block = self._samples.block(self._connection)
        data = packed(block, self._found.channels)
        if len(data) > DATA_BYTES:
            self._say("left out", f"A text at {block.stamps[0]} s has {len(data)} bytes; allowed are {DATA_BYTES}.")
        elif not self._hand(SAMPLES, block.received, data):
            return False
        self._samples.clear()
        return True

    def _correct(self, inlet: Any) -> None:
        asked = time.monotonic()
        measured = time_correction(inlet, CORRECTION_WITHIN_S)
        if measured is not None:
            self._clock = measured
            row = np.array([(self._connection, asked, time.monotonic(), *measured)], CORRECTION_ROW)
            self._hand(CORRECTED, asked, row.tobytes())

    def _quality(self) -> StreamQuality:
        watch, (offset, _, uncertainty) = self._watch, self._clock or (None, None, None)
        return StreamQuality(self._topic, watch.rate_Hz, watch.gaps, offset, uncertainty)

    def _look_elsewhere(self) -> None:
        """Raise `_GoneError` if the device now publishes another outlet.

        A device that was switched off leaves its old outlet open, so that the old connection shows no error.
        """
        there = lsl().resolve_bypred(self._found.predicate, 1, LOOK_S)
        if there and self._uid not in {info.uid() for info in there}:
            raise _GoneError("it has come back as another outlet")

    def _say(self, kind: str, text: str, xml: str | None = None) -> None:
        self._note(StreamNote(time.monotonic(), self._topic, kind, text, self._connection, xml))


SILENT = ("silent", f"The stream has sent nothing for {SILENT_S:g} s, and its source is still there.")
RESUMED = ("resumed", "The stream sends again.")


class _GoneError(Exception):
    """End of a connection; for this file only."""


class _Samples:
    """Samples that wait for their block, in preallocated memory."""

    def __init__(self, found: FoundStream):
        self._is_text = found.value_type == "string"
        self.count, self.since, self._received = 0, np.inf, 0.0
        if self._is_text:
            self._most, self._texts, self._stamps = 1, list[list[str]](), np.empty(1)
            return
        kind = np.dtype({"double64": "float64"}.get(found.value_type, found.value_type))
        one = packed_size(1, found.channels, kind.itemsize) - packed_size(0, found.channels, kind.itemsize)
        self._most = (DATA_BYTES - packed_size(0, found.channels, kind.itemsize)) // one
        self._values, self._stamps = np.empty((self._most, found.channels), kind), np.empty(self._most)

    @property
    def is_full(self) -> bool:
        """True if no other sample fits into the block."""
        return self.count == self._most

    def pull(self, inlet: Any) -> int:
        """Pull as many samples as are there and fit, and return their number."""
        room = self._most - self.count
        if not room:
            return 0
        if self._is_text:
            values, stamps = inlet.pull_chunk(0.0, room, as_numpy=True)
            self._texts += [[text.decode(errors="surrogateescape") for text in sample] for sample in values]
        else:
            _, stamps = inlet.pull_chunk(0.0, room, dest_obj=self._values[self.count :])
        self._stamps[self.count : self.count + len(stamps)] = stamps
        if len(stamps):
            self._received = time.monotonic()
            self.since = min(self.since, self._received)
        self.count += len(stamps)
        return len(stamps)

    def newest(self, count: int) -> Float[np.ndarray, " sample"]:
        """Return the stamps of the newest samples [s]."""
        return self._stamps[self.count - count : self.count]

    def block(self, connection: int) -> StreamBlock:
        """Return a block of all waiting samples."""
        values = self._texts if self._is_text else self._values[: self.count]
        return StreamBlock(self._received, connection, self._stamps[: self.count], values)

    def clear(self) -> None:
        """Empty the buffer after its samples have been handed over."""
        self.count, self.since = 0, np.inf
        if self._is_text:
            self._texts.clear()


def time_correction(inlet: Any, within_s: float) -> tuple[float, float, float] | None:
    """Return offset, time of its measurement on the device's clock, and uncertainty [s]; None after a time-out.

    `StreamInlet.time_correction` returns only the offset.
    """
    from pylsl.lib import lib

    ask = lib.lsl_time_correction_ex
    ask.restype = ctypes.c_double
    ask.argtypes = [ctypes.c_void_p, *[ctypes.POINTER(ctypes.c_double)] * 2, ctypes.c_double]
    ask.argtypes = [*ask.argtypes, ctypes.POINTER(ctypes.c_int)]
    remote, uncertainty, error = ctypes.c_double(), ctypes.c_double(), ctypes.c_int()
    offset = ask(inlet.obj, ctypes.byref(remote), ctypes.byref(uncertainty), within_s, ctypes.byref(error))
    return None if error.value else (offset, remote.value, uncertainty.value)
