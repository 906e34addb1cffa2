"""Messages that stay in the file: each is read again when it is asked for."""

from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import overload

from .contents import ChunkPart, chunk_data, message_data
from .fields import Channel, Message
from .file_content import foreign_messages_refused, read_content
from .message_check import read_message
from .schema import CHANNELS

IN_MEMORY_BYTES = 1_000_000
"""Size of a channel above which its messages stay in the file; as Python objects they take several times as much."""


class StoredMessages(Sequence[Message]):
    """Messages of a JSON channel in a file, with one chunk in memory at a time."""

    def __init__(self, path: Path, channel: Channel):
        self._path, self._channel = path, channel
        self.settings: Message = {}
        """Settings of the recording, against which the messages are checked."""
        self._chunks, self._offsets = array("Q"), array("L")
        self._last: tuple[int, bytes] = (-1, b"")

    def add(self, chunk: int, offset: int) -> None:
        """Note the place of the next message."""
        self._chunks.append(chunk)
        self._offsets.append(offset)

    def __len__(self) -> int:
        return len(self._offsets)

    @overload
    def __getitem__(self, number: int, /) -> Message: ...

    @overload
    def __getitem__(self, number: slice, /) -> list[Message]: ...

    def __getitem__(self, number: int | slice, /) -> Message | list[Message]:
        if isinstance(number, slice):
            return [self[k] for k in range(*number.indices(len(self)))]
        chunk, offset = self._chunks[number], self._offsets[number]
        if self._last[0] != chunk:
            with read_content(self._path) as content:
                self._last = chunk, chunk_data(content, chunk)
        with foreign_messages_refused(self._path):
            text = bytes(message_data(self._last[1], offset))
            return read_message(self._path, self._channel, text, self.settings)

    def __iter__(self) -> Iterator[Message]:
        yield from (self[k] for k in range(len(self)))
        self._last = (-1, b"")


class ChannelMessages:
    """Messages of a channel, collected in a pass: in memory as long as they are few, otherwise by their places."""

    def __init__(self, path: Path, topic: str):
        self._path, self._channel = path, CHANNELS[topic]
        self._places = StoredMessages(path, self._channel)
        self._texts: list[bytes] | None = []
        self._size = 0
        self.first = list[bytes]()
        """Text of the first message; empty if there is none."""

    def take(self, part: ChunkPart) -> None:
        """Take the next message."""
        self._places.add(part.chunk, part.offset)
        self.first = self.first or [bytes(part.data)]
        self._size += len(part.data)
        if self._size > IN_MEMORY_BYTES:
            self._texts = None
        elif self._texts is not None:
            self._texts.append(bytes(part.data))

    def messages(self, settings: Message) -> list[Message] | StoredMessages:
        """Return all messages of the channel, in memory or read from the file on demand."""
        if self._texts is None:
            self._places.settings = settings
            return self._places
        return [read_message(self._path, self._channel, text, settings) for text in self._texts]
