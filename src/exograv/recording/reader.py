"""Reader of recordings, also of those whose writer was killed: all up to the last complete chunk."""

import contextlib
import json
import os
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.writer import MCAP0_MAGIC

from exograv.errors import RecordingError

from .contents import Contents, FileEnding, examine
from .device_stream import DeviceStream, joined
from .encoding import restored, unpacked_ticks
from .fields import Message
from .schema import CHANNELS, PACKED_VERSION, TICK
from .stream_block import TOPICS, unpacked, value_type_of

READABLE = range(1, PACKED_VERSION + 1)
"""Versions of the format that can be read."""


@dataclass(frozen=True)
class Recording:
    """Content of a recording file, in memory."""

    path: Path
    settings: Message
    """Settings of the run: the message of the channel `/settings`."""

    ticks: np.ndarray
    """Structured array, one record per tick; fields and units are in the table of `/tick`."""

    remark: str | None
    """Sentence on what is wrong with the file; None for a complete one."""

    _messages: Mapping[str, Sequence[Message]]

    streams: tuple[DeviceStream, ...] = ()
    """Streams of other devices."""

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

    def phase_ticks(self, name: str) -> np.ndarray:
        """Return the ticks of the last phase with this name; empty if there was none."""
        numbers = [k for k, phase in enumerate(self.messages("/phase"), start=1) if phase["name"] == name]
        return self.ticks[self.ticks["phase"] == (numbers or [-1])[-1]]


def read_recording(path: Path) -> Recording:
    """Read a whole recording.

    Raises:
        RecordingError: The file is missing, is not a recording of exograv, or has an unknown version.
    """
    path = Path(path)
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
        topic: [restored(channel.fields, json.loads(data)) for data in parts[topic]]
        for topic, channel in CHANNELS.items()
        if channel is not TICK
    }
    streams = _streams(found, parts, messages, ticks)
    return Recording(path, settings, ticks, remark_on(path, size, found, ticks), messages, streams)


def _streams(
    found: Contents, parts: Mapping[str, list[bytes]], messages: Mapping[str, Sequence[Message]], ticks: np.ndarray
) -> tuple[DeviceStream, ...]:
    types = {schema.id: value_type_of(schema.name) for schema in found.schemas}
    topics = [(channel.topic, channel.schema_id) for channel in found.channels]
    streams = [(topic, types[kind]) for topic, kind in topics if topic.startswith(TOPICS)]
    return tuple(
        joined(
            topic,
            kind,
            [unpacked(data, kind) for data in parts.get(topic, ())],
            messages["/stream"],
            messages["/correction"],
            ticks,
        )
        for topic, kind in streams
    )


class FileContent:
    """Bytes of an open file, read on demand; a failing disk raises a `RecordingError`."""

    def __init__(self, path: Path, file: BinaryIO):
        """Take the size of the file at this moment."""
        self._path, self._file = path, file
        self._size = os.fstat(file.fileno()).st_size

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, part: slice, /) -> bytes:
        start, stop, _ = part.indices(self._size)
        try:
            self._file.seek(start)
            return self._file.read(max(stop - start, 0))
        except OSError as error:
            raise RecordingError(_unreadable(self._path, error)) from error


@contextlib.contextmanager
def read_content(path: Path) -> Iterator[FileContent]:
    """Open the bytes of an MCAP file for the duration of the block.

    Raises:
        RecordingError: The file is missing, or of another kind.
    """
    try:
        file = path.open("rb")
    except OSError as error:
        raise RecordingError(_unreadable(path, error)) from error
    with file:
        content = FileContent(path, file)
        if content[: len(MCAP0_MAGIC)] != MCAP0_MAGIC:
            raise RecordingError(
                f"{path} is not an MCAP file. A recording of exograv ends in .mcap and begins with its mark."
            )
        yield content


def _unreadable(path: Path, error: OSError) -> str:
    return f"The recording {path} cannot be read: {error.strerror}. Check its path."


def settings_of(path: Path, messages: list[bytes]) -> Message:
    """Return the settings of the run, from the messages of `/settings`.

    Raises:
        RecordingError: The message is missing, or of a version that this exograv does not read.
    """
    if not messages:
        raise RecordingError(
            f"{path} holds no /settings: exograv did not write it, or it was cut before its first chunk."
        )
    settings = json.loads(messages[0])
    if settings.get("schema_version") not in READABLE:
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
