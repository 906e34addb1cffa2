"""Reader of messages other than ticks, one at a time: streams of other devices, and frequent messages."""

import json
from collections.abc import Collection, Iterator
from pathlib import Path

from .contents import Contents, messages_in
from .encoding import restored
from .fields import Message
from .file_content import read_content
from .schema import CHANNELS
from .stream_block import StreamBlock, unpacked, value_type_of


def other_pieces(
    path: Path, topics: Collection[str] = (), with_streams: bool = True
) -> Iterator[tuple[str, StreamBlock | Message]]:
    """Yield topic and message in the order of the file; for `/lsl/…`, a block of samples.

    Args:
        path: The recording.
        topics: JSON channels to yield.
        with_streams: True to yield streams of other devices too.

    Raises:
        RecordingError: The file is missing, or of another kind.
    """
    found = Contents()
    with read_content(path) as content:
        for topic, data in messages_in(content, found):
            if topic in topics:
                yield topic, restored(CHANNELS[topic].fields, json.loads(data))
            elif with_streams and topic not in CHANNELS:
                types = {schema.id: value_type_of(schema.name) for schema in found.schemas}
                kind = next(types[channel.schema_id] for channel in found.channels if channel.topic == topic)
                yield topic, unpacked(data, kind)
