"""Messages of ROS 2 have the bytes, names and hashes of other implementations."""

import hashlib
import json
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.runtime.ros2.messages import (
    FLOAT64,
    JOINT_STATE,
    STRING,
    MessageType,
    float64,
    joint_state,
    read_float64,
    string,
)

STAMP_NS = 1_700_000_000_123_456_789
NAMES = ("shoulder_flexion", "elbow")

# rosbags 0.11.9 wrote these bytes: `get_typestore(Stores.ROS2_JAZZY).serialize_cdr`.
WRITTEN = (
    "0001000000f1536515cd5b070100000000000000020000001100000073686f756c6465725f666c6578696f6e0000000006000000656c626f77"
    "0000000200000000000000000000000000e03f000000000000f4bf000000000200000000000000000008400000000000001040"
)
EMPTY = "000100000000000005000000010000000000000000000000000000000000000000000000"

NESTED, INT32, UINT32, FLOAT, TEXT, SEQUENCE = 1, 6, 7, 11, 17, 144
"""Codes of type_description_interfaces/msg/FieldType; `SEQUENCE` is added for an unbounded sequence."""

TIME = ("builtin_interfaces/msg/Time", [("sec", INT32, ""), ("nanosec", UINT32, "")])
HEADER = ("std_msgs/msg/Header", [("stamp", NESTED, TIME[0]), ("frame_id", TEXT, "")])
DESCRIBED = {
    JOINT_STATE: (
        [
            ("header", NESTED, HEADER[0]),
            ("name", TEXT + SEQUENCE, ""),
            ("position", FLOAT + SEQUENCE, ""),
            ("velocity", FLOAT + SEQUENCE, ""),
            ("effort", FLOAT + SEQUENCE, ""),
        ],
        [TIME, HEADER],
    ),
    FLOAT64: ([("data", FLOAT, "")], []),
    STRING: ([("data", TEXT, "")], []),
}

numbers = st.floats(allow_nan=False)


@st.composite
def states(draw: st.DrawFn):
    names = draw(st.lists(st.text(st.characters(exclude_characters="\0", codec="utf-8"), max_size=20), max_size=5))
    rows = st.one_of(st.just([]), st.lists(numbers, min_size=len(names), max_size=len(names)))
    return draw(st.integers(0, 2**31 * 10**9 - 1)), names, draw(rows), draw(rows), draw(rows)


def read_joint_state(message: bytes) -> tuple[int, list[str], list[float], list[float], list[float]]:
    """Read a joint state by the rule of alignment alone, independently of the writer."""
    assert message[:4] == b"\0\1\0\0"
    body, at = message[4:], 0

    def take(kind: str) -> float:
        nonlocal at
        size = struct.calcsize(kind)
        at += -at % size
        (value,) = struct.unpack_from("<" + kind, body, at)
        at += size
        return value

    def text() -> str:
        nonlocal at
        length = int(take("I"))
        content = body[at : at + length]
        at += length
        assert content[-1:] == b"\0"
        return content[:-1].decode()

    stamp = int(take("i")) * 10**9 + int(take("I"))
    assert text() == ""
    names = [text() for _ in range(int(take("I")))]
    q, v, tau = ([take("d") for _ in range(int(take("I")))] for _ in range(3))
    assert at == len(body)
    return stamp, names, q, v, tau


@given(states())
def test_a_joint_state_comes_back_unchanged(state):
    assert read_joint_state(joint_state(*state)) == state


def test_joint_states_are_the_bytes_of_another_writer():
    assert joint_state(STAMP_NS, NAMES, (0.5, -1.25), (), (3.0, 4.0)).hex() == WRITTEN
    assert joint_state(5, (), (), (), ()).hex() == EMPTY


@given(states())
def test_another_writer_agrees_on_every_joint_state(state):
    types = pytest.importorskip("rosbags.typesys")
    store = types.get_typestore(types.Stores.ROS2_JAZZY)
    stamp, names, *rows = state
    time = store.types[TIME[0]](*divmod(stamp, 10**9))
    header = store.types[HEADER[0]](time, "")
    message = store.types[JOINT_STATE.name](header, names, *(np.array(row, dtype=np.float64) for row in rows))
    assert joint_state(*state) == bytes(store.serialize_cdr(message, JOINT_STATE.name))


@given(st.floats())
def test_a_number_comes_back_in_either_byte_order(value: float):
    bits = struct.pack("<d", value)
    for message in (float64(value), b"\0\0\0\0" + struct.pack(">d", value)):
        found = read_float64(message)
        assert found is not None
        assert struct.pack("<d", found) == bits


@given(st.binary(max_size=24))
def test_an_invalid_message_gives_none_and_never_an_error(message: bytes):
    found = read_float64(message)
    is_one = 12 <= len(message) <= 16 and message[:2] in (b"\0\0", b"\0\1")
    assert (found is not None) == is_one


def test_a_text_ends_with_a_zero_byte_that_its_length_counts():
    assert string("damping") == b"\0\1\0\0" + b"\x08\0\0\0" + b"damping\0"
    assert string("°")[4:] == b"\x03\0\0\0" + "°".encode() + b"\0"


@pytest.mark.parametrize("kind", list(DESCRIBED), ids=lambda kind: kind.name)
def test_the_hash_of_a_type_is_that_of_its_description(kind: MessageType):
    """Compare with rosidl's hash: SHA-256 of the description in JSON, referenced types sorted by name (REP-2016)."""
    fields, referenced = DESCRIBED[kind]
    description = {
        "type_description": described(kind.name, fields),
        "referenced_type_descriptions": [described(*one) for one in sorted(referenced)],
    }
    assert kind.hash == "RIHS01_" + hashlib.sha256(json.dumps(description).encode()).hexdigest()


def described(name: str, fields: list[tuple[str, int, str]]) -> dict:
    def kind(number: int, nested: str) -> dict:
        return {"type_id": number, "capacity": 0, "string_capacity": 0, "nested_type_name": nested}

    return {
        "type_name": name,
        "fields": [{"name": field, "type": kind(number, nested)} for field, number, nested in fields],
    }


def test_a_type_has_its_dds_name():
    assert JOINT_STATE.dds_name == "sensor_msgs::msg::dds_::JointState_"
