"""Blocks that the listener hands to the recorder: samples in the form of the file, and LSL's clock corrections."""

from dataclasses import dataclass

import numpy as np

from exograv.recording.fields import described
from exograv.recording.messages import ClockCorrection
from exograv.recording.stream_block import StreamFormat
from exograv.runtime.processes.shared_memory import Ring

DATA_BYTES = 16_000
"""Largest length of a block's data [bytes]."""

SLOTS = 1024
"""Number of blocks in the ring: 16 MB, ten seconds without a recorder at 1.6 MB/s.

Samples that find no room stay with LSL, which keeps minutes.
"""

BLOCK = np.dtype(
    [("stream", "<u2"), ("kind", "u1"), ("monotonic", "<f8"), ("length", "<u4"), ("data", f"V{DATA_BYTES}")]
)
"""Type of a block: `stream` counts from 0, `kind` is one of those below, `monotonic` is the time of arrival [s]."""

SAMPLES, CORRECTED = 0, 1
"""Kinds of blocks: samples of a stream, correction of its clock."""

NUMBERS = {int: "<u4", float: "<f8"}
CORRECTION_ROW = np.dtype(
    [(name, NUMBERS[kind]) for name, (kind, *_) in described(ClockCorrection).items() if kind in NUMBERS]
)
"""Data of a `CORRECTED` block: the message of `/correction`, without its topic."""

TAKEN_MAX = 256
"""Blocks that the recorder takes at a time (4 MB): a device that floods must not keep ticks from the disk."""


@dataclass(frozen=True)
class RecordedDevices:
    """Other devices of a run, for its recorder."""

    ring: str
    """Name of the shared memory."""

    streams: tuple[StreamFormat, ...]

    def blocks(self) -> Ring:
        """Return the ring: the listener writes, the recorder reads."""
        return Ring(BLOCK, SLOTS, self.ring)


def block(stream: int, kind: int, monotonic: float, data: bytes) -> np.ndarray:
    """Return an entry of the ring."""
    row = np.zeros((), BLOCK)
    row["stream"], row["kind"], row["monotonic"], row["length"] = stream, kind, monotonic, len(data)
    row["data"] = np.void(data.ljust(DATA_BYTES, b"\0"))
    return row
