"""Every text from a page is read as a known message, or as a reason to close its line (F34)."""

import json

import hypothesis.strategies as st
import pytest
from hypothesis import given

from exograv.console.limits import DEPTH_MAX, MESSAGE_MAX_BYTES, Close
from exograv.console.messages import ActMessage, Heartbeat, Ping, depth, read_message

JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=5), inner, max_size=3),
    max_leaves=30,
)


def nested(levels: int) -> str:
    """Text of an act with nested brackets."""
    return '{"kind":"do","id":"12345678","made":1.0,"act":{"x":' + "[" * levels + "]" * levels + "}}"


@given(text=st.text() | st.binary() | JSON.map(json.dumps))
def test_anything_is_read_without_an_exception(text: str | bytes):
    outcome = read_message(text)
    assert isinstance(outcome, Close)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (b'{"kind":"beat"}', Close.PROTOCOL),
        ("", Close.PROTOCOL),
        ("{", Close.PROTOCOL),
        ('{"kind":"beat"', Close.PROTOCOL),
        ('{"kind":"beat"} x', Close.PROTOCOL),
        ('{"kind":"ping","asked":NaN}', Close.POLICY),
        ('{"kind":"ping","asked":Infinity}', Close.POLICY),
        ("[]", Close.POLICY),
        ("null", Close.POLICY),
        ('{"kind":"engage"}', Close.POLICY),
        ('{"kind":"beat","more":1}', Close.POLICY),
        ('{"kind":"ping","asked":"1"}', Close.POLICY),
        ('{"kind":"ping","asked":-1}', Close.POLICY),
        ('{"kind":"ping","asked":1e300}', Close.POLICY),
        ('{"kind":"ping","asked":1e999}', Close.POLICY),
        ('{"kind":"ping","asked":true}', Close.POLICY),
        ('{"kind":"steer","id":"short"}', Close.POLICY),
        ('{"kind":"touches","touches":[]}', Close.POLICY),
        ('{"kind":"beat","x":"' + "a" * MESSAGE_MAX_BYTES + '"}', Close.TOO_BIG),
        ('{"kind":"beat","x":"' + "ä" * (MESSAGE_MAX_BYTES // 2) + '"}', Close.TOO_BIG),
        ("[" * 5000, Close.POLICY),
        (nested(DEPTH_MAX - 1), Close.POLICY),
        ('{"kind":"ping","asked":' + "9" * 5000 + "}", Close.PROTOCOL),
    ],
)
def test_what_is_malformed_closes_the_line_with_the_code_for_it(text: str | bytes, why: Close):
    assert read_message(text) is why


def test_what_is_well_formed_is_read():
    assert read_message('{"kind":"beat"}') == Heartbeat()
    assert read_message('{"kind":"ping","asked":1}') == Ping(asked=1.0)
    assert isinstance(read_message(nested(DEPTH_MAX - 2)), ActMessage)


@given(value=JSON)
def test_depth_is_that_of_the_brackets_and_not_of_those_in_strings(value: object):
    def deep(one: object) -> int:
        if isinstance(one, dict):
            return 1 + max(map(deep, one.values()), default=0)
        return 1 + max(map(deep, one), default=0) if isinstance(one, list) else 0

    assert depth(json.dumps(value)) == deep(value)


def test_a_lone_surrogate_is_no_reason_to_fall():
    assert read_message('{"kind":"steer","id":"\ud800"}') in (Close.PROTOCOL, Close.POLICY)
