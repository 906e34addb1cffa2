"""A file with right check sums, written by another program, is refused with a sentence, however it is read."""

from pathlib import Path

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.records import Chunk
from mcap.writer import MCAP0_MAGIC

from exograv.errors import RecordingError
from exograv.recording import open_recording, read_recording
from fuzz.recording import JOINTS, Inside, sealed, seeds, unsealed

READERS = pytest.mark.parametrize("read", [read_recording, open_recording])
HEAD = 22
"""Bytes before the content of a message."""


def changed(topic: str, content: bytes) -> bytes:
    """Return a recording with other content in the messages of a topic, and right check sums."""
    channels, chunks = unsealed(seeds()[1])
    number = 1 + [name for name, *_ in channels].index(topic)
    return sealed(
        Inside(
            channels,
            [[(k, body[:HEAD] + content if k == number else body) for k, body in chunk] for chunk in chunks],
        )
    )


def test_a_recording_that_is_taken_apart_and_sealed_again_holds_the_same(tmp_path: Path):
    for number, data in enumerate(seeds()[:2]):
        path = tmp_path / f"{number}.mcap"
        path.write_bytes(sealed(unsealed(data)))
        recording = read_recording(path)
        assert recording.remark is None
        assert recording.joints == JOINTS
        assert len(recording.ticks) == 12
        assert len(recording.streams) == 2


@READERS
@pytest.mark.parametrize(
    ("topic", "content"),
    [
        ("/settings", b"[]"),
        ("/settings", b"\xff\xfe"),
        ("/settings", b'{"schema_version": 5}'),
        ("/settings", b'{"schema_version": 5, "joints": 3}'),
        ("/phase", b"{"),
        ("/phase", b"[" * 100_000),
        ("/lsl/amp", b""),
        ("/lsl/amp", bytes(20) + b"\xff" * 8),
        ("/lsl/keys", bytes(28) + b"\xff" * 8),
    ],
    ids=range(9),
)
def test_a_message_of_another_program_is_an_error_that_names_the_file(tmp_path: Path, read, topic: str, content: bytes):
    path = tmp_path / "foreign.mcap"
    path.write_bytes(changed(topic, content))
    with pytest.raises(RecordingError, match=r"foreign\.mcap"):
        read(path)


@READERS
def test_a_chunk_without_a_message_holds_nothing(tmp_path: Path, read):
    path, records = tmp_path / "empty.mcap", RecordBuilder()
    Chunk("zstd", zstandard.compress(b""), 0, 0, 0, 0).write(records)
    path.write_bytes(MCAP0_MAGIC + records.end())
    with pytest.raises(RecordingError, match="holds no /settings"):
        read(path)


def test_ticks_of_another_number_of_joints_are_an_error_when_they_are_read(tmp_path: Path):
    path = tmp_path / "joints.mcap"
    data = b'{"schema_version": 5, "joints": ["elbow"]}'
    path.write_bytes(changed("/settings", data))
    with pytest.raises(RecordingError, match=r"joints\.mcap"):
        list(open_recording(path).pieces(("q_measured",)))
