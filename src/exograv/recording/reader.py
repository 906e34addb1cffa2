"""Reader of recordings, also of those whose writer was killed: all up to the last complete chunk."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

from exograv.errors import RecordingError

from .computing_times import FIELDS, ComputingTimes, computing_times
from .contents import Contents, FileEnding, examine
from .device_stream import DeviceStream, joined
from .encoding import unpacked_ticks
from .fields import Message
from .file_content import foreign_messages_refused, read_content
from .message_check import read_message
from .schema import CHANNELS, PACKED_VERSION, SETTINGS, TICK
from .stored_ticks import StoredTicks
from .stream_block import TOPICS, StreamBlock, unpacked, value_type_of

READABLE = range(1, PACKED_VERSION + 1)
"""Versions of the format that can be read."""


@dataclass(frozen=True)
class Recording:
    """Content of a recording file, in memory or read on demand."""

    path: Path
    settings: Message
    """Settings of the run: the message of the channel `/settings`."""

    ticks: np.ndarray
    """Structured array, one record per tick; fields and units are in the table of `/tick`.

    It is empty if the ticks stay in the file (`open_recording`); `pieces` and `phase_pieces` read both.
    """

    remark: str | None
    """Sentence on what is wrong with the file; None for a complete one."""

    _messages: Mapping[str, Sequence[Message]]

    streams: tuple[DeviceStream, ...] = ()
    """Streams of other devices."""

    stored: StoredTicks | None = None
    """Ticks that stay in the file."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Actuated joints, in the order of each per-joint array."""
        return tuple(self.settings["joints"])

    @property
    def is_simulated(self) -> bool:
        """True if no person was in the machine: a twin has a disturbance level, a participant model has settings."""
        settings = self.settings
        return (
            "participant_model" in (settings.get("settings") or {})
            or settings.get("disturbance_level") is not None
            or "--simulate" in (settings.get("command") or "")
        )

    def messages(self, topic: str) -> Sequence[Message]:
        """Return all messages of a JSON channel, in the order of writing; empty if there are none."""
        return self._messages.get(topic, [])

    def last(self, topic: str) -> Message:
        """Return the last message of a JSON channel, or an empty one."""
        return (self.messages(topic) or [{}])[-1]

    @property
    def tick_count(self) -> int:
        """Number of ticks, in memory or in the file."""
        return sum(self.stored.counts.values()) if self.stored is not None else len(self.ticks)

    def pieces(self, fields: Sequence[str]) -> Iterator[np.ndarray]:
        """Yield these fields of all ticks, in pieces (tick,) that fit into memory."""
        if self.stored is not None:
            return self.stored.pieces(fields)
        return iter([self.ticks[list(fields)]])

    def phase_ticks(self, name: str) -> np.ndarray:
        """Return the ticks of the last phase with this name; empty if there was none."""
        return self.ticks[self.ticks["phase"] == self._phase_number(name)]

    def phase_pieces(self, name: str, fields: Sequence[str]) -> Iterator[np.ndarray]:
        """Yield these fields of the ticks of the last phase with this name, in pieces (tick,) that fit into memory."""
        if self.stored is not None:
            return self.stored.pieces(fields, self._phase_number(name))
        return iter([self.phase_ticks(name)[list(fields)]])

    def phase_length(self, name: str) -> int:
        """Return the number of ticks of the last phase with this name."""
        if self.stored is not None:
            return self.stored.counts.get(self._phase_number(name), 0)
        return len(self.phase_ticks(name))

    @cached_property
    def computing_times(self) -> ComputingTimes:
        """Computing times of all ticks, and the share of ticks in which the envelope limited the torque."""
        return computing_times(self.pieces(FIELDS), len(self.joints))

    def _phase_number(self, name: str) -> int:
        """Return the number of the last phase with this name; -1 if there was none."""
        return max((k for k, phase in enumerate(self.messages("/phase"), start=1) if phase["name"] == name), default=-1)


def read_recording(path: Path) -> Recording:
    """Read a whole recording.

    Raises:
        RecordingError: The file is missing, is not a recording of exograv, or has an unknown version.
    """
    path = Path(path)
    with foreign_messages_refused(path):
        return _read(path)


def _read(path: Path) -> Recording:
    parts: defaultdict[str, list[bytes]] = defaultdict(list)
    packed = bytearray()  # a whole session has two gigabytes: never keep them twice in memory

    def visit(topic: str, data: bytes) -> None:
        if topic == TICK.topic:
            packed.extend(data)
        else:
            parts[topic].append(data)

    with read_content(path) as content:
        found, size = examine(content, visit), len(content)
    settings = settings_of(path, parts["/settings"])
    ticks = unpacked_ticks(packed, len(settings["joints"]), settings["schema_version"])
    messages = {
        topic: [read_message(path, channel, data, settings) for data in parts[topic]]
        for topic, channel in CHANNELS.items()
        if channel not in (TICK, SETTINGS)
    }
    streams = streams_of(found, _blocks(found, parts), messages, ticks)
    return Recording(path, settings, ticks, remark_on(path, size, found, ticks), messages, streams)


def _blocks(found: Contents, parts: Mapping[str, list[bytes]]) -> dict[str, list[StreamBlock]]:
    return {topic: [unpacked(data, kind) for data in parts.get(topic, ())] for topic, kind in stream_types(found)}


def stream_types(found: Contents) -> list[tuple[str, str]]:
    """Return the topics of other devices' streams, each with LSL's name of its type of value."""
    types = {schema.id: schema.name for schema in found.schemas}
    topics = [(channel.topic, channel.schema_id) for channel in found.channels]
    return [(topic, value_type_of(types[kind])) for topic, kind in topics if topic.startswith(TOPICS)]


def streams_of(
    found: Contents,
    blocks: Mapping[str, Sequence[StreamBlock]],
    messages: Mapping[str, Sequence[Message]],
    ticks: np.ndarray,
) -> tuple[DeviceStream, ...]:
    """Return the streams of other devices, from their blocks by topic."""
    return tuple(
        joined(topic, kind, blocks.get(topic, ()), messages["/stream"], messages["/correction"], ticks)
        for topic, kind in stream_types(found)
    )


def settings_of(path: Path, messages: list[bytes]) -> Message:
    """Return the settings of the run, from the messages of `/settings`.

    Raises:
        RecordingError: The message is missing or damaged, or of a version that this exograv does not read.
    """
    if not messages:
        raise RecordingError(
            f"{path} holds no /settings: exograv did not write it, or it was cut before its first chunk."
        )
    settings = read_message(path, SETTINGS, messages[0])
    if settings["schema_version"] not in READABLE:
        raise RecordingError(
            f"{path} has version {settings.get('schema_version')} of the recording format; this exograv reads up to "
            f"{PACKED_VERSION}. Read it with the version that wrote it: {settings.get('versions', 'unknown')}."
        )
    return settings


def remark_on(path: Path, size: int, found: Contents, ticks: np.ndarray) -> str | None:
    """Return a sentence on what is wrong with a file of so many bytes; None for a complete one."""
    until = f"at {ticks['t'][-1]:.3f} s" if len(ticks) else "before the first tick"
    remarks = {
        FileEnding.COMPLETE: None,
        FileEnding.CUT: (
            f"{path.name} ends abruptly {until}: its writer was stopped, and what was not yet on disk is lost."
        ),
        FileEnding.DAMAGED: (
            f"{path.name} is damaged: {found.good} of its {size} bytes could be used, and its ticks end "
            f"{until}. Take another copy of it if there is one."
        ),
    }
    return remarks[found.ending]
