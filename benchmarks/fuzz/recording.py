"""Recordings that are damaged, or written by another program: only errors of `exograv.errors` are allowed.

A chunk has a check sum, so that a changed byte alone reaches no reader of messages. `mutate` therefore changes one
message and writes the file anew, with right check sums and indexes. Every input of the corpus is a recording file.
"""

import contextlib
import random
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Schema

from exograv.errors import ExogravError
from exograv.recording import RecordingWriter, open_recording, read_recording
from exograv.recording.container import INDEX_ENTRY, MESSAGE_HEAD, RECORD_HEAD, ChunkedFile
from exograv.recording.contents import Contents, chunk_data, parts_in
from exograv.recording.encoding import empty_ticks
from exograv.recording.stream_block import StreamBlock, StreamFormat, packed

JOINTS = ("shoulder", "elbow")
STREAMS = (StreamFormat("/lsl/amp", "float32"), StreamFormat("/lsl/keys", "string"))

_FOLDER = tempfile.TemporaryDirectory()
_FILE = Path(_FOLDER.name) / "fuzz.mcap"


class Inside(NamedTuple):
    """Content of a recording without check sums and indexes."""

    channels: list[tuple[str, str, Schema]]
    """Topic, encoding and schema."""

    chunks: list[list[tuple[int, bytes]]]
    """Channel number from 1 and message record of each message, by chunk."""


def seeds() -> list[bytes]:
    """Return a recording with ticks in rows, one with ticks in columns, and both cut off."""
    whole = [_recording(is_packed) for is_packed in (False, True)]
    return [*whole, *(data[: len(data) // 2] for data in whole), *(sealed(unsealed(data)) for data in whole)]


def _recording(is_packed: bool) -> bytes:
    stamps = np.arange(3.0)
    with RecordingWriter(_FILE, JOINTS, {"rig": "fuzz"}, STREAMS, packed=is_packed) as recording:
        recording.phase(0.0, "float")
        recording.ticks(empty_ticks(12, len(JOINTS)))
        numbers, words = np.ones((3, 2), np.float32), [["a", "b"]] * 3
        recording.write_block("/lsl/amp", 0.01, packed(StreamBlock(1.0, 1, stamps, numbers), 2))
        recording.write_block("/lsl/keys", 0.01, packed(StreamBlock(1.0, 1, stamps, words), 2))
    return _FILE.read_bytes()


def unsealed(data: bytes) -> Inside:
    """Return the content of a recording; of a damaged one the part before the damage."""
    found, places = Contents(), dict[int, None]()
    for part in parts_in(data, found):
        places[part.chunk] = None
    schemas = {schema.id: schema for schema in found.schemas}
    channels = [(one.topic, one.message_encoding, schemas[one.schema_id]) for one in found.channels]
    numbers = {one.id: number for number, one in enumerate(found.channels, start=1)}
    return Inside(channels, [_messages(chunk_data(data, place), numbers) for place in places])


def _messages(chunk: bytes, numbers: dict[int, int]) -> list[tuple[int, bytes]]:
    messages, start = list[tuple[int, bytes]](), 0
    while start < len(chunk):
        _, size = RECORD_HEAD.unpack_from(chunk, start)
        start += RECORD_HEAD.size
        channel, *times = MESSAGE_HEAD.unpack_from(chunk, start)
        body = MESSAGE_HEAD.pack(numbers[channel], *times) + chunk[start + MESSAGE_HEAD.size : start + size]
        messages.append((numbers[channel], body))
        start += size
    return messages


def sealed(inside: Inside) -> bytes:
    """Return a recording with this content, with right check sums and indexes."""
    with tempfile.TemporaryFile() as stream:
        file = ChunkedFile(stream)
        file.begin()
        for topic, encoding, schema in inside.channels:
            file.add_channel(topic, encoding, schema)
        for chunk in inside.chunks:
            records, index = bytearray(), dict[int, list[tuple[int, int]]]()
            for channel, body in chunk:
                index.setdefault(channel, []).append((MESSAGE_HEAD.unpack_from(body)[2], len(records)))
                records += RECORD_HEAD.pack(Opcode.MESSAGE, len(body)) + body
            if chunk:
                file.add_chunk(bytes(records), {key: np.array(rows, INDEX_ENTRY) for key, rows in index.items()})
        file.finish()
        stream.seek(0)
        return stream.read()


def mutate(data: bytes, size: int, seed: int, change: Callable[[bytes, int], bytes]) -> bytes:
    """Change a message of a recording, or leave it out, or a schema's name; seldom the bytes of the file itself."""
    dice = random.Random(seed)
    with contextlib.suppress(Exception):  # a file without a good chunk
        inside = unsealed(data)
        chunk = dice.choice(inside.chunks)
        k, what = dice.randrange(len(chunk)), dice.random()
        channel, body = chunk[k]
        if what < 0.8:
            head, content = body[: MESSAGE_HEAD.size], body[MESSAGE_HEAD.size :]
            chunk[k] = channel, head + change(content, len(content) + 64)
        elif what < 0.85:
            del chunk[k]
        elif what < 0.9:
            number = dice.randrange(len(inside.channels))
            schema = inside.channels[number][2]
            schema.name = change(schema.name.encode(), 40).decode(errors="ignore")
        else:
            return change(data, size)
        return sealed(inside)[:size]
    return change(data, size)


def read(data: bytes) -> None:
    """Read a recording at once and on demand; both must agree on its end."""
    _FILE.write_bytes(data)
    endings = list[bool]()
    for reader in (read_recording, open_recording):
        with contextlib.suppress(ExogravError):
            recording = reader(_FILE)
            for piece in recording.pieces(("t", "q_measured")):
                len(piece)
            endings.append(recording.remark is None)
    if len(set(endings)) > 1:
        raise AssertionError("the two readers disagree on the end of the file")
