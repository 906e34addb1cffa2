"""Programs without knowledge of exograv read a recording: by its index, as a stream, and by its schemas alone."""

import json
import re
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import NonSeekingReader, SeekingReader

from exograv.recording import RecordingWriter, read_recording
from exograv.recording.schema import CHANNELS, TICK

JOINTS = ("rotation", "flexion", "elbow")
PER_JOINT = [field.name for field in TICK.fields if field.size]
PARAMETER = {"name": "upper_arm.mass", "unit": "kg", "prior": 2.0, "estimate": 2.1}
MESSAGES = [
    ("/phase", {"name": "identify"}),
    ("/event", {"kind": "note", "text": "Größer als ½"}),
    ("/estimate", {"motion_s": 1.0, "parameters": [PARAMETER | {"ci95": None}], "outcome": "running"}),
    ("/estimate", {"motion_s": 2.0, "parameters": [PARAMETER | {"ci95": [2.0, 2.2]}], "outcome": "running"}),
    ("/skeleton", {"exo": [[0.0, 0.1, 0.2], [0.3, 0.4, 0.5]], "arm": [[1.0, 2.0, 3.0]]}),
    ("/left_over", {"motion_s": 1.0, "total": [0.1, 0.2, 0.3]}),
    ("/control", {"act": "publish", "x": [1.0, 2.0], "q": [0.0, 0.1, 0.2], "taken": True}),
    ("/result", {"identifiability": None, "known_weight": {"true_kg": 1.0, "free": None}}),
]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("viewers") / "a.mcap"
    settings = {"rig": "recupera_like", "hashes": {"rig": "0" * 64}, "settings": {"options": {"level": 2}}}
    with RecordingWriter(path, JOINTS, settings) as recording:
        for k, (topic, message) in enumerate(MESSAGES):
            values = {name: np.arange(3.0) + 0.1 * k + n for n, name in enumerate(PER_JOINT)}
            recording.tick(1e-3 * k, **values, closure_slope=1e-9, tick_us=40.0, now=1e-3 * k, sequence=k)
            recording.write(topic, 1e-3 * k, message)
    return path


def test_the_index_and_the_stream_hold_the_same_messages(path: Path):
    with path.open("rb") as stream:
        reader = SeekingReader(stream, validate_crcs=True)
        by_index = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()]
        summary = reader.get_summary()
    with path.open("rb") as stream:
        streamed = [(c.topic, m.log_time, m.data) for _, c, m in NonSeekingReader(stream).iter_messages()]
    assert sorted(by_index) == sorted(streamed)
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(by_index) == 2 * len(MESSAGES) + 1
    assert [time for _, time, _ in by_index] == sorted(time for _, time, _ in by_index)


ROS2 = {"float64": "d", "float32": "f", "uint32": "I"}


def decoded(definition: str, data: bytes) -> dict[str, Any]:
    """Read a message by its ROS 2 definition and the rules of plain CDR: each value at a multiple of its own size.

    Source: OMG DDS-XTypes 1.3, 7.4.3, encoding version 1; ROS 2 interface definitions, fixed-size arrays.
    """
    assert data[:4] == b"\x00\x01\x00\x00"
    found, body, at = {}, data[4:], 0
    for line in definition.splitlines():
        ((kind, length, name),) = re.findall(r"^(\w+)(?:\[(\d+)\])? (\w+)(?:\s+#.*)?$", line)
        size, count = struct.calcsize(ROS2[kind]), int(length or 1)
        at += -at % size
        values = struct.unpack_from(f"<{count}{ROS2[kind]}", body, at)
        found[name], at = list(values) if length else values[0], at + count * size
    assert at == len(body)
    return found


def test_a_tick_is_read_by_the_definition_in_the_file_alone(path: Path):
    ticks = read_recording(path).ticks
    with path.open("rb") as stream:
        for k, (schema, channel, message) in enumerate(SeekingReader(stream).iter_messages(topics=["/tick"])):
            assert schema is not None
            assert (schema.encoding, channel.message_encoding, schema.name) == ("ros2msg", "cdr", "exograv/msg/Tick")
            found = decoded(schema.data.decode(), message.data)
            for name, value in found.items():
                np.testing.assert_array_equal(ticks[name][k], value)
            assert message.log_time == round(1e9 * found["t"])


def json_channels(path: Path) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Yield schema and message of each JSON message."""
    with path.open("rb") as stream:
        for schema, channel, message in SeekingReader(stream).iter_messages():
            if channel.message_encoding == "json":
                assert schema is not None
                assert schema.encoding == "jsonschema"
                yield json.loads(schema.data), json.loads(message.data)


PLAIN = {"string": str, "number": (int, float), "integer": int, "boolean": bool}


def check(schema: dict[str, Any], value: Any) -> None:
    """Check a value against the used part of JSON Schema."""
    if schema["type"] == "object":
        assert isinstance(value, dict)
        assert set(schema.get("required", ())) <= set(value)
        if schema.get("additionalProperties") is False:
            assert set(value) <= set(schema["properties"])
        for name, one in schema["properties"].items():
            if name in value:
                check(one, value[name])
    elif schema["type"] == "array":
        assert isinstance(value, list)
        assert schema.get("minItems", 0) <= len(value) <= schema.get("maxItems", len(value))
        for one in value:
            check(schema["items"], one)
    else:
        assert isinstance(value, PLAIN[schema["type"]])


def test_every_message_fits_its_schema(path: Path):
    seen = [check(schema, message) for schema, message in json_channels(path)]
    assert len(seen) == len(MESSAGES) + 1


def understood(schema: dict[str, Any], *, in_array: bool = False) -> None:
    """Check that a schema has no part that Foxglove Studio and Lichtblick refuse (their `parseJsonSchema.ts`)."""
    kind = schema["type"]
    assert isinstance(kind, str)
    assert not (in_array and kind == "array")
    if kind == "object":
        for one in schema["properties"].values():
            understood(one)
    elif kind == "array":
        understood(schema["items"], in_array=True)
    else:
        assert kind in PLAIN


def test_the_schemas_are_in_the_part_of_the_language_that_viewers_understand(path: Path):
    with path.open("rb") as stream:
        summary = SeekingReader(stream).get_summary()
    assert summary is not None
    schemas = [schema for schema in summary.schemas.values() if schema.encoding == "jsonschema"]
    assert len(schemas) == len(CHANNELS) - 1
    for schema in schemas:
        understood(json.loads(schema.data))


def test_what_was_written_comes_back_with_its_nulls_and_points(path: Path):
    recording = read_recording(path)
    assert [one["parameters"][0]["ci95"] for one in recording.messages("/estimate")] == [None, [2.0, 2.2]]
    assert recording.last("/skeleton")["exo"] == MESSAGES[4][1]["exo"]
    assert recording.last("/result")["known_weight"] == {"true_kg": 1.0, "free": None}
    assert recording.last("/result").get("identifiability") is None
