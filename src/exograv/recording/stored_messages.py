"""Messages that stay in the file: each is read again when it is asked for."""

from array import array
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import overload

from .contents import chunk_data, message_data
from .fields import Channel, Message
from .file_content import foreign_messages_refused, read_content
from .message_check import read_message


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
