"""Messages read one at a time are those of the whole recording, in the order of the file."""

from pathlib import Path

import numpy as np

from exograv.recording import RecordingWriter, read_recording
from exograv.recording.stream_block import StreamBlock, StreamFormat, packed
from exograv.recording.stream_pieces import other_pieces


def written(path: Path) -> Path:
    with RecordingWriter(
        path, (), {}, [StreamFormat("/lsl/a", "float32"), StreamFormat("/lsl/b", "int16")]
    ) as recording:
        for k in range(5):
            recording.write("/event", 1.0 * k, {"kind": "note", "text": str(k)})
            recording.write("/skeleton", 1.0 * k, {"exo": [[0.0, 0.0, 0.0]], "arm": [[1.0, 2.0, 1.0 * k]]})
            for topic, kind in (("/lsl/a", np.float32), ("/lsl/b", np.int16)):
                block = StreamBlock(1.0 * k, 1, np.array([1.0 * k, k + 0.5]), np.full((2, 1), k, kind))
                recording.write_block(topic, 1.0 * k, packed(block, 1))
    return path


def test_chosen_messages_come_one_at_a_time(tmp_path: Path):
    path = written(tmp_path / "run.mcap")
    found = [message for topic, message in other_pieces(path, ["/skeleton"], with_streams=False) if topic]
    assert found == read_recording(path).messages("/skeleton")


def test_streams_come_block_by_block_in_their_own_type(tmp_path: Path):
    path = written(tmp_path / "run.mcap")
    pieces = list(other_pieces(path))
    assert [topic for topic, _ in pieces] == ["/lsl/a", "/lsl/b"] * 5
    for stream in read_recording(path).streams:
        blocks = [block for topic, block in pieces if topic == stream.topic and isinstance(block, StreamBlock)]
        assert np.array_equal(np.concatenate([block.values for block in blocks]), stream.values)
        assert blocks[0].values.dtype == stream.values.dtype
        assert np.array_equal(np.concatenate([block.stamps for block in blocks]), stream.stamps)
