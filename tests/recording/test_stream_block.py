"""Samples of another device come back bit by bit, and a reader with only CDR and the schema finds the same."""

import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader

from exograv.recording import RecordingWriter, read_recording
from exograv.recording.stream_block import TYPES, StreamBlock, StreamFormat, packed, packed_size, unpacked

NUMBERS = sorted(TYPES.keys() - {"string"})


def numbers(value_type: str, samples: int, channels: int) -> np.ndarray:
    rng = np.random.default_rng(1000)
    return rng.integers(-120, 120, (samples, channels)).astype(TYPES[value_type])


@pytest.mark.parametrize("value_type", NUMBERS)
@pytest.mark.parametrize("channels", [1, 3])
def test_numbers_come_back_unchanged(value_type: str, channels: int):
    values, stamps = numbers(value_type, 7, channels), np.random.default_rng(1001).standard_normal(7)
    data = packed(StreamBlock(12.5, 3, stamps, values), channels)
    found = unpacked(data, value_type)
    assert (found.received, found.connection) == (12.5, 3)
    assert found.stamps.tobytes() == stamps.tobytes()
    assert found.values.dtype == values.dtype
    np.testing.assert_array_equal(found.values, values)
    assert len(data) <= packed_size(7, channels, values.itemsize)


@settings(max_examples=50, deadline=None)
@given(texts=st.lists(st.tuples(st.text(), st.text()), min_size=1, max_size=5))
def test_texts_come_back_unchanged(texts: list[tuple[str, str]]):
    samples = [list(sample) for sample in texts]
    data = packed(StreamBlock(0.0, 1, np.arange(float(len(samples))), samples), 2)
    assert unpacked(data, "string").values == samples


def test_bytes_that_are_not_valid_text_come_back_unchanged():
    blob = bytes(range(256)).decode(errors="surrogateescape")
    found = unpacked(packed(StreamBlock(0.0, 1, np.zeros(1), [[blob]]), 1), "string")
    assert found.values[0][0].encode(errors="surrogateescape") == bytes(range(256))


SIZES = {"float64": 8, "float32": 4, "uint32": 4, "int8": 1, "int16": 2, "int32": 4, "int64": 8}
CODES = {"float64": "d", "float32": "f", "uint32": "I", "int8": "b", "int16": "h", "int32": "i", "int64": "q"}


def read_by_schema(definition: str, data: bytes) -> dict[str, list]:
    """Read a message by the rules of CDR: each value aligned to its size, a sequence led by its length."""
    start, found = 4, {}

    def value(kind: str):
        nonlocal start
        start += -(start - 4) % SIZES[kind]
        start += SIZES[kind]
        return struct.unpack_from(f"<{CODES[kind]}", data, start - SIZES[kind])[0]

    def text() -> str:
        nonlocal start
        size = value("uint32")
        start += size
        return data[start - size : start - 1].decode()

    for line in definition.splitlines():
        kind, name = line.split()[:2]
        is_sequence, one = kind.endswith("[]"), kind.removesuffix("[]")
        count = value("uint32") if is_sequence else 1
        found[name] = [text() if one == "string" else value(one) for _ in range(count)]
    assert start == len(data)
    return found


@pytest.mark.parametrize("value_type", sorted(TYPES))
def test_a_reader_that_knows_only_the_schema_in_the_file_finds_the_same(tmp_path: Path, value_type: str):
    path, kind = tmp_path / "a.mcap", StreamFormat("/lsl/amp", value_type)
    texts = [["a", "ß"], ["", "äöü"], ["bcd", "e"]]
    values = texts if value_type == "string" else numbers(value_type, 3, 2)
    stamps = np.array([0.25, 1.5, -7.0])
    with RecordingWriter(path, (), {}, [kind]) as recording:
        recording.write_block("/lsl/amp", 1.0, packed(StreamBlock(12.5, 1, stamps, values), 2))
    with path.open("rb") as stream:
        ((schema, _, message),) = make_reader(stream, validate_crcs=True).iter_messages("/lsl/amp")
    assert schema is not None
    assert (schema.encoding, schema.name) == ("ros2msg", kind.schema_name)
    found = read_by_schema(schema.data.decode(), message.data)
    assert found["stamps"] == stamps.tolist()
    flat = [text for sample in texts for text in sample] if value_type == "string" else np.ravel(values).tolist()
    assert (found["received"], found["connection"], found["channels"], found["values"]) == ([12.5], [1], [2], flat)


def test_a_file_with_streams_is_continued_with_them(tmp_path: Path):
    path = tmp_path / "a.mcap"
    block = packed(StreamBlock(12.5, 1, np.zeros(1), np.zeros((1, 2), np.float32)), 2)
    recording = RecordingWriter(path, (), {}, [StreamFormat("/lsl/amp", "float32")])
    recording.write_block("/lsl/amp", 1.0, block)
    recording.sync()
    recording._stream.close()  # as if the writer had been killed
    with RecordingWriter.continued(path) as again:
        assert again.count("/lsl/amp") == 1
        again.write_block("/lsl/amp", 2.0, block)
    found = read_recording(path)
    assert found.remark is None
    assert [len(stream.stamps) for stream in found.streams] == [2]
