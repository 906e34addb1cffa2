"""Every packet survives a round trip, and no other bytes are a packet."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.rig.drives.udp.layout import COMMAND_JOINT, Type, length
from exograv.rig.drives.udp.packets import Header, Refusal, RefusedError, decode, encode, refuse_wrong_command

WORDS = st.integers(0, 2**32 - 1)
FLOATS = st.floats(width=32, allow_nan=False)


@given(st.integers(0, 16), WORDS, WORDS, WORDS, WORDS, st.integers(0, 2**64 - 1), st.data())
def test_a_command_comes_back_as_it_was_sent(
    joints: int, session: int, grant: int, sequence: int, answers: int, time_ns: int, data: st.DataObject
):
    numbers = tuple(data.draw(FLOATS) for _ in range(joints * len(COMMAND_JOINT)))
    header = Header(Type.COMMAND, joints, 3, session, grant, sequence, answers, time_ns)
    packet = decode(encode(header, (17, 4), numbers))
    assert packet == (header, (17, 4), numbers)


def command(current: float = 1.0, damping: float = 0.0) -> bytes:
    header = Header(Type.COMMAND, 2, 1, 5, 6, 7, 8, 9)
    return encode(header, (0, 5000), (current, damping, current, damping))


@given(st.integers(0, 8 * length(Type.COMMAND, 2) - 1))
def test_no_single_flipped_bit_passes(bit: int):
    data = bytearray(command())
    data[bit // 8] ^= 1 << bit % 8
    with pytest.raises(RefusedError):
        decode(bytes(data))


@given(st.binary(max_size=1500))
def test_what_is_no_packet_is_refused_and_nothing_worse(data: bytes):
    with pytest.raises(RefusedError):
        decode(data)


@pytest.mark.parametrize("size", [0, 3, 35, 36, 55, 57, 1500])
def test_every_other_length_is_refused(size: int):
    with pytest.raises(RefusedError) as refused:
        decode(command().ljust(1500, b"\0")[:size])
    assert refused.value.why is Refusal.LENGTH


@pytest.mark.parametrize("wrong", [{"current": math.nan}, {"current": math.inf}, {"damping": -0.1}])
def test_a_command_without_numbers_or_that_drives_what_it_should_damp_is_refused(wrong: dict[str, float]):
    with pytest.raises(RefusedError) as refused:
        refuse_wrong_command(decode(command(**wrong)))
    assert refused.value.why is Refusal.NUMBER
