"""A stream of another device, read back: all as received, and its stamps on the robot's clock in a column beside."""

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


@dataclass(frozen=True)
class DeviceStream:
    """One stream; one row a sample."""

    topic: str
    value_type: str
    """LSL's name of it."""

    stamps: Samples
    """Exactly as received: the device's own clock [s]."""

    values: Any
    """Exactly as received: an array (sample, channel), or of strings a list of lists."""

    received: Samples
    """CLOCK_MONOTONIC, by which it had come [s]."""

    connection: Int[np.ndarray, " sample"]
    """Counted from 1; another one may have another clock."""

    notes: tuple[StreamNote, ...]
    corrections: tuple[ClockCorrection, ...]

    ticks: np.ndarray
    """Of the recording: they have both clocks of the robot."""

    @cached_property
    def description(self) -> ElementTree.Element:
        """The first description that it gave of itself; empty if that was lost."""
        texts = [note.xml for note in self.notes if note.xml]
        return ElementTree.fromstring(texts[0]) if texts else ElementTree.Element("info")

    @property
    def name(self) -> str:
        """As it names itself."""
        return self.description.findtext("name") or self.topic

    @property
    def kind(self) -> str:
        """Type of content, such as `EEG`."""
        return self.description.findtext("type") or ""

    @property
    def nominal_rate_Hz(self) -> float:
        """As it says; 0 where samples come as they come."""
        return float(self.description.findtext("nominal_srate") or 0.0)

    @property
    def channels(self) -> int:
        """Values of a sample."""
        return int(self.description.findtext("channel_count") or 0)

    @property
    def labels(self) -> tuple[str, ...]:
        """Of the channels, as far as they have some."""
        return tuple(label.text or "" for label in self.description.iterfind("desc/channels/channel/label"))

    @cached_property
    def clocks(self) -> dict[int, ClockFit]:
        """How its clock runs, by connection; none where LSL has measured nothing."""
        fits = dict[int, ClockFit]()
        for number in sorted({one.connection for one in self.corrections}):
            of = [one for one in self.corrections if one.connection == number]
            fit = fit_clock(np.array([one.remote for one in of]), np.array([one.offset for one in of]))
            if fit is not None:
                fits[number] = fit
        return fits

    @cached_property
    def monotonic(self) -> Samples:
        """Stamps on CLOCK_MONOTONIC of the robot's computer [s]; NaN where LSL has measured nothing."""
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
    """The rig's clock at times of CLOCK_MONOTONIC [s], by the ticks, which have both; itself without any.

    Before the first and after the last tick the two clocks are taken to run alike.
    """
    ticks = ticks[np.isfinite(ticks["monotonic"])]
    if not len(ticks):
        return monotonic
    ahead = ticks["now"] - ticks["monotonic"]
    return monotonic + np.interp(monotonic, ticks["monotonic"], ahead)


def joined(
    topic: str,
    value_type: str,
    blocks: Sequence[StreamBlock],
    notes: Sequence[Message],
    corrections: Sequence[Message],
    ticks: np.ndarray,
) -> DeviceStream:
    """A stream from its messages."""
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
