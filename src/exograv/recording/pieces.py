"""Reader for recordings larger than memory: chosen messages, and ticks in pieces, in one pass."""

from collections.abc import Collection, Iterator
from pathlib import Path

import numpy as np

from .contents import ChunkPart, Contents, parts_in
from .encoding import tick_dtype, unpacked_ticks
from .file_content import read_content
from .reader import Recording, remark_on, settings_of
from .schema import SETTINGS, TICK
from .stored_messages import ChannelMessages


class RecordingPass:
    """Single pass through a recording: `for ticks in passing.ticks(): …`, and then `passing.recording()`."""

    def __init__(self, path: Path, topics: Collection[str] = ()):
        """Prepare a pass; nothing is read yet.

        Args:
            path: The recording.
            topics: JSON channels to keep, beside `/settings`. Messages of a long channel stay in the file.
        """
        self.path = Path(path)
        self._wanted = {SETTINGS.topic, *topics}
        self._channels: dict[str, ChannelMessages] = {}
        self._last, self._size, self._found = np.empty(0), 0, Contents()
        self._is_through = False

    def ticks(self) -> Iterator[np.ndarray]:
        """Yield all ticks in order, some thousands per piece: structured arrays (tick,) as `Recording.ticks`.

        Raises:
            RecordingError: The file is missing, is not a recording of exograv, or has an unknown version.
        """
        n_joints, version = 0, 0
        for part in self._parts():
            if part.topic in self._wanted:
                self._channels[part.topic].take(part)
            elif part.topic == TICK.topic:
                if not version:  # settings come first in the file
                    settings = settings_of(self.path, self._channels[SETTINGS.topic].first)
                    n_joints, version = len(settings["joints"]), settings["schema_version"]
                data = part.data if isinstance(part.data, bytes) else part.data.tobytes()
                ticks = unpacked_ticks(data, n_joints, version)
                self._last = ticks[-1:]
                yield ticks
        self._is_through = True

    def recording(self) -> Recording:
        """Return settings, remark and the chosen messages; `ticks` and `streams` are empty.

        Raises:
            RecordingError: The file is missing, is not a recording of exograv, or has an unknown version.
        """
        if not self._is_through:
            for _ in self.ticks():
                pass
        settings = settings_of(self.path, self._channels[SETTINGS.topic].first)
        messages = {topic: one.messages(settings) for topic, one in self._channels.items() if topic != SETTINGS.topic}
        none = np.empty(0, tick_dtype(len(settings["joints"])))
        last = self._last if len(self._last) else none
        return Recording(self.path, settings, none, remark_on(self.path, self._size, self._found, last), messages)

    def _parts(self) -> Iterator[ChunkPart]:
        self._channels = {topic: ChannelMessages(self.path, topic) for topic in self._wanted}
        self._found = Contents()
        with read_content(self.path) as content:
            self._size = len(content)
            yield from parts_in(content, self._found)


def read_topics(path: Path, topics: Collection[str]) -> Recording:
    """Read settings, remark and these JSON channels of a recording, in a few megabytes; `ticks` is empty.

    Raises:
        RecordingError: The file is missing, is not a recording of exograv, or has an unknown version.
    """
    return RecordingPass(path, topics).recording()


def tick_pieces(path: Path) -> Iterator[np.ndarray]:
    """Return all ticks of a recording, some thousands per piece.

    Raises:
        RecordingError: The file is missing, is not a recording of exograv, or has an unknown version.
    """
    return RecordingPass(path).ticks()
