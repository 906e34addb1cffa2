"""Acceleration of a sensor on Lab Streaming Layer, sent at once as the data of an aircraft."""

import contextlib
import queue
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import datetime

import numpy as np

from exograv.errors import ConfigError
from exograv.recording.messages import StreamNote
from exograv.recording.stream_block import StreamBlock, unpacked
from exograv.runtime.lsl.blocks import SAMPLES
from exograv.runtime.lsl.library import lsl
from exograv.runtime.lsl.quality import StreamQuality
from exograv.runtime.lsl.stream_reader import StreamReader
from exograv.runtime.lsl.streams import LOOK_S, FoundStream, choose, formats
from exograv.task.aircraft_line import DAY_MS, G_MAX, RATE_HZ, AircraftSample, line_of
from exograv.task.task_settings import AircraftSettings

from .aircraft import Destination, Say, sender_to
from .sensor_file.series import Parabolas
from .sensor_file.table import Column, Names, acceleration_columns, channel_columns, factor_of

FIND_S = 10.0
"""Time to find the stream [s]."""

DESCRIBED_WITHIN_S, WAIT_S = 2.0, 0.2
REFUSED_ALL = 100
"""Number of samples of which none is usable after which the unit is wrong."""

EVENTS = {
    "connected": "The stream is connected.",
    "lost": "The stream is gone. The relay looks for it; the receiver closes an open window by its clock.",
}
"""Sentences about events of the stream, by `StreamNote.kind`; others have their own."""


@dataclass(frozen=True)
class SensorStream:
    """Stream of an acceleration, and what it does not state itself."""

    name: str
    names: Names = field(default_factory=Names)


@dataclass(frozen=True)
class Relayed:
    """Result of `exograv data aircraft relay`."""

    sent: int
    """Datagrams."""

    refused: int
    """Samples of the sensor that are not finite, or beyond the limit of the aircraft's data."""

    connections: int
    """Connections with the sensor's program."""


class Periods:
    """Means of the sensor's acceleration in periods of the aircraft's feed, from blocks of its stream."""

    def __init__(self, place: list[int], factor: float, settings: AircraftSettings, level: float):
        """Begin a flight.

        Args:
            place: Channels of the three axes.
            factor: Acceleration of one unit of the stream [g].
            settings: Aircraft settings of the protocol.
            level: Gravity level of the windows [-].
        """
        self._place, self._factor, self._parabolas = place, factor, Parabolas(settings, level)
        self._begun_s, self._connection = time.monotonic(), 0
        self._offset_s = self._latest = -np.inf
        self._period, self._sum, self._count = 0, np.zeros(3), 0
        self.used = self.refused = 0

    def finished(self, block: StreamBlock) -> Iterator[AircraftSample]:
        """Yield the sample of each period that the block finishes. A period without a usable value gives none."""
        if block.connection != self._connection:  # a new program, perhaps with another clock
            self._connection, self._latest = block.connection, -np.inf
            self._offset_s = block.received - self._begun_s - float(block.stamps[-1])
        values = self._factor * np.asarray(block.values, float)[:, self._place]
        for stamp, g in zip(block.stamps.tolist(), values, strict=True):
            if not (stamp > self._latest and np.isfinite(g).all() and np.abs(g).max() <= G_MAX):
                self.refused += 1
                continue
            self.used, self._latest = self.used + 1, stamp
            period = int((stamp + self._offset_s) * RATE_HZ)
            if period != self._period and self._count:
                yield self._sample()
            self._period, self._sum, self._count = period, self._sum + g, self._count + 1

    def _sample(self) -> AircraftSample:
        t, mean = self._period / RATE_HZ, self._sum / self._count
        self._sum, self._count = np.zeros(3), 0
        return self._parabolas.sample(t, _since_midnight_ms(), mean)


def relay(
    stream: SensorStream, settings: AircraftSettings, level: float, where: Destination, seconds: float, say: Say
) -> Relayed:
    """Send the acceleration of a stream as data of an aircraft, for a time [s] or until Ctrl-C.

    Args:
        stream: The stream.
        settings: Aircraft settings of the protocol. Their limits count the parabolas.
        level: Gravity level of the windows [-].
        where: Receiver.
        seconds: Time [s].
        say: Prints a line.

    Raises:
        ConfigError: The stream is not there, is no acceleration with a known unit, or the address cannot be reached.
    """
    found = _found(stream.name)
    axes = acceleration_columns(_channels(found), stream.names)
    periods = Periods([axis.place for axis in axes], factor_of(axes, stream.names.unit), settings, level)
    blocks, over, connections = queue.SimpleQueue[StreamBlock](), threading.Event(), 0

    def hand(kind: int, _t: float, data: bytes) -> bool:
        if kind == SAMPLES:
            blocks.put(unpacked(data, found.value_type))
        return True

    def note(one: StreamNote | StreamQuality) -> None:
        nonlocal connections
        if isinstance(one, StreamNote):
            connections = one.connection
            say(EVENTS.get(one.kind, one.text))

    topic = formats([found])[0].topic
    reader = threading.Thread(target=StreamReader(found, topic, 0, hand, note).run, args=(over,))
    sent, until = 0, time.monotonic() + seconds
    with sender_to(where) as send:
        reader.start()
        say(f"{found.name} of {found.host} goes to {where.host}:{where.port}; press Ctrl-C to end.")
        try:
            while time.monotonic() < until:
                with contextlib.suppress(queue.Empty):
                    for sample in periods.finished(blocks.get(timeout=WAIT_S)):
                        send(line_of(sample))
                        sent += 1
                if not periods.used and periods.refused > REFUSED_ALL:
                    raise ConfigError(
                        f"All {periods.refused} samples of {found.name} are beyond {G_MAX:g} g or not finite. "
                        "Correct --unit or --columns."
                    )
        except KeyboardInterrupt:
            say("Ended by Ctrl-C.")
        finally:
            over.set()
            reader.join()
    return Relayed(sent, periods.refused, connections)


def _found(name: str) -> FoundStream:
    """Return the stream of this name or type.

    Raises:
        ConfigError: No stream, several streams, or a stream of texts has it.
    """
    found = choose([name], FIND_S)
    if len(found) > 1:
        listed = ", ".join(f"'{one.name}'" for one in found)
        raise ConfigError(f"--stream is '{name}'; these streams have it as name or type: {listed}. Name one.")
    if found[0].value_type == "string":
        raise ConfigError(f"Stream '{name}' holds texts, not numbers. Correct --stream.")
    return found[0]


def _channels(found: FoundStream) -> list[Column]:
    """Return the channels in the description that the stream's program gives.

    Raises:
        ConfigError: The program does not answer.
    """
    from pylsl.util import LostError

    there = lsl().resolve_bypred(found.predicate, 1, LOOK_S)
    try:
        info = lsl().StreamInlet(there[0], recover=False).info(DESCRIBED_WITHIN_S) if there else None
    except (TimeoutError, LostError):
        info = None
    if info is None:
        raise ConfigError(f"The program of stream '{found.name}' does not answer. Start it again.")
    labels, units = (
        [text or "" for text in texts or ()] for texts in (info.get_channel_labels(), info.get_channel_units())
    )
    return channel_columns(labels, units, found.channels)


def _since_midnight_ms() -> int:
    now = datetime.now().astimezone()
    midnight = now.replace(hour=0, minute=0, second=0, microsecond=0)
    return round(1e3 * (now - midnight).total_seconds()) % DAY_MS
