"""Stream of another device, read back: unchanged samples, and in further columns their times on the robot's clock."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float, Int

from exograv.clock_fit import ClockFit, fit_clock

from .fields import Message, read_as
from .messages import ClockCorrection, StreamNote
from .stream_block import StreamBlock

Samples = Float[np.ndarray, " sample"]

CLOCK_EVERY = 100
"""Interval of kept ticks that relate the rig's clock to the computer's, where both run evenly [ticks]."""

UNEVEN_S = 10e-6
"""Difference between the two clocks over one tick above which both ticks are kept. The twin's clock stands still in a
missed period.
"""


@dataclass(frozen=True)
class DeviceStream:
    """Stream of another device, one row per sample."""

    topic: str
    value_type: str
    """Name of the value type in LSL."""

    stamps: Samples
    """Time stamps exactly as received, on the device's own clock [s]."""

    values: Any
    """Values exactly as received: an array (sample, channel), or a list of lists for strings."""

    received: Samples
    """CLOCK_MONOTONIC of the computer when the sample had arrived [s]."""

    connection: Int[np.ndarray, " sample"]
    """Number of the connection, from 1; each connection may have another clock."""

    notes: tuple[StreamNote, ...]
    corrections: tuple[ClockCorrection, ...]

    ticks: np.ndarray
    """Ticks of the recording, which carry both clocks of the robot."""

    @cached_property
    def description(self) -> ElementTree.Element:
        """First description that the stream gave of itself; empty if the description was lost."""
        texts = [note.xml for note in self.notes if note.xml]
        return ElementTree.fromstring(texts[0]) if texts else ElementTree.Element("info")

    @property
    def name(self) -> str:
        """Name of the stream in its description."""
        return self.description.findtext("name") or self.topic

    @property
    def kind(self) -> str:
        """Type of content, such as `EEG`."""
        return self.description.findtext("type") or ""

    @property
    def nominal_rate_Hz(self) -> float:
        """Sample rate in the description; 0 for an irregular rate."""
        return float(self.description.findtext("nominal_srate") or 0.0)

    @property
    def channels(self) -> int:
        """Number of values per sample."""
        return int(self.description.findtext("channel_count") or 0)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the channels, as far as the description has them."""
        return tuple(label.text or "" for label in self.description.iterfind("desc/channels/channel/label"))

    @cached_property
    def clocks(self) -> dict[int, ClockFit]:
        """Fitted clock by connection; empty if LSL has measured no correction."""
        fits = dict[int, ClockFit]()
        for number in sorted({one.connection for one in self.corrections}):
            of = [one for one in self.corrections if one.connection == number]
            fit = fit_clock(np.array([one.remote for one in of]), np.array([one.offset for one in of]))
            if fit is not None:
                fits[number] = fit
        return fits

    @cached_property
    def monotonic(self) -> Samples:
        """Stamps on CLOCK_MONOTONIC of the robot's computer [s]; NaN if LSL has measured no correction."""
        found = np.full(len(self.stamps), np.nan)
        for number, fit in self.clocks.items():
            of = self.connection == number
            found[of] = self.stamps[of] + fit.correction(self.stamps[of])
        return found

    @cached_property
    def t(self) -> Samples:
        """Stamps on the rig's clock, as `t` of a tick [s]; without a robot, `monotonic`."""
        return rig_time(self.ticks, self.monotonic)


def rig_time(ticks: np.ndarray, monotonic: Samples) -> Samples:
    """Return times on the rig's clock for CLOCK_MONOTONIC [s], by ticks, which have both; unchanged without ticks.

    Before the first and after the last tick the two clocks are assumed to run alike.
    """
    ticks = ticks[np.isfinite(ticks["monotonic"])]
    if not len(ticks):
        return monotonic
    ahead = ticks["now"] - ticks["monotonic"]
    return monotonic + np.interp(monotonic, ticks["monotonic"], ahead)


def clock_ticks(ticks: np.ndarray) -> np.ndarray:
    """Select ticks that relate the two clocks: some of a piece, and all between which the clocks differ."""
    is_kept = np.arange(len(ticks)) % CLOCK_EVERY == 0
    is_kept[-1] = True
    apart = np.flatnonzero(np.abs(np.diff(ticks["now"] - ticks["monotonic"])) > UNEVEN_S)
    is_kept[apart] = is_kept[apart + 1] = True
    return ticks[is_kept]


def joined(
    topic: str,
    value_type: str,
    blocks: Sequence[StreamBlock],
    notes: Sequence[Message],
    corrections: Sequence[Message],
    ticks: np.ndarray,
) -> DeviceStream:
    """Build a stream from its messages."""
    counts = [len(block.stamps) for block in blocks]
    if value_type == "string":
        values: Any = [sample for block in blocks for sample in block.values]
    else:
        values = np.concatenate([block.values for block in blocks]) if blocks else np.empty((0, 0))
    return DeviceStream(
        topic,
        value_type,
        np.concatenate([block.stamps for block in blocks]) if blocks else np.empty(0),
        values,
        np.repeat([block.received for block in blocks] or np.empty(0), counts or 0),
        np.repeat(np.array([block.connection for block in blocks], dtype=int), counts or 0),
        tuple(read_as(StreamNote, note) for note in notes if note["topic"] == topic),
        tuple(read_as(ClockCorrection, one) for one in corrections if one["topic"] == topic),
        ticks,
    )
