"""Recording whose ticks and long channels stay in the file: memory does not grow with its length."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .contents import ChunkPart, Contents, parts_in
from .encoding import tick_dtype
from .fields import Message
from .file_content import foreign_messages_refused, read_content
from .reader import Recording, remark_on, settings_of, stream_types, streams_of
from .schema import CHANNELS, SETTINGS, TICK
from .stored_messages import ChannelMessages
from .stored_ticks import StoredTicks
from .stream_block import TOPICS, StreamBlock, unpacked


def open_recording(path: Path) -> Recording:
    """Check a whole recording, and return it with its ticks and long channels left in the file.

    The file must stay as it is. Streams of other devices have their stamps, but no values.

    Raises:
        RecordingError: The file is missing, is not a recording of exograv, or has an unknown version.
    """
    with foreign_messages_refused(Path(path)):
        return _scanned(Path(path))


def _scanned(path: Path) -> Recording:
    scan = _Scan(path)
    with read_content(scan.path) as content:
        for part in parts_in(content, scan.found, ("t", "phase")):
            scan.take(part)
        size = len(content)
    settings = scan.settings
    none = np.empty(0, tick_dtype(len(settings["joints"])))
    messages = {topic: one.messages(settings) for topic, one in scan.channels.items() if topic != SETTINGS.topic}
    last = scan.last if len(scan.last) else none
    remark = remark_on(scan.path, size, scan.found, last)
    recording = Recording(scan.path, settings, none, remark, messages, stored=scan.ticks)
    if not stream_types(scan.found):
        return recording
    clocks = [ticks[np.isfinite(ticks["monotonic"])] for ticks in recording.pieces(("now", "monotonic"))]
    both = np.concatenate(clocks) if clocks else none
    streams = streams_of(scan.found, scan.blocks, messages, both)
    return Recording(scan.path, settings, none, remark, messages, streams, scan.ticks)


@dataclass
class _Scan:
    """First pass through a file."""

    path: Path
    found: Contents = field(default_factory=Contents)
    last: np.ndarray = field(default_factory=lambda: np.empty(0))
    """Last tick, with its time."""

    blocks: dict[str, list[StreamBlock]] = field(default_factory=dict)
    """Samples of other devices without their values, by topic."""

    def __post_init__(self):
        self.channels = {topic: ChannelMessages(self.path, topic) for topic in CHANNELS if topic != TICK.topic}
        self._ticks: StoredTicks | None = None
        self._types: dict[str, str] = {}
        self._settings: Message | None = None

    @property
    def settings(self) -> Message:
        """Settings of the run: the message of the channel `/settings`."""
        if self._settings is None:
            self._settings = settings_of(self.path, self.channels[SETTINGS.topic].first)
        return self._settings

    @property
    def ticks(self) -> StoredTicks:
        """Places of the ticks."""
        if self._ticks is None:  # settings come first in the file
            settings = self.settings
            version = settings["schema_version"]
            self._ticks = StoredTicks(self.path, len(settings["joints"]), version, self.found.topics)
        return self._ticks

    def take(self, part: ChunkPart) -> None:
        """Take a part of a chunk."""
        if part.topic == TICK.topic:
            ticks = self.ticks.add(part)
            self.last = ticks[-1:] if len(ticks) else self.last
        elif part.topic in self.channels:
            self.channels[part.topic].take(part)
        elif part.topic.startswith(TOPICS) and isinstance(part.data, bytes):
            self.blocks.setdefault(part.topic, []).append(self._without_values(part.topic, part.data))

    def _without_values(self, topic: str, data: bytes) -> StreamBlock:
        self._types = self._types or dict(stream_types(self.found))
        block = unpacked(data, self._types[topic])
        values = np.empty((len(block.stamps), 0)) if isinstance(block.values, np.ndarray) else []
        return StreamBlock(block.received, block.connection, block.stamps.copy(), values)
