"""A line opens after a hello in time, and stays open as long as it sends allowed messages (F34)."""

import contextlib
import json

import pytest
from starlette.websockets import WebSocketDisconnect

from exograv.console import line as line_module
from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.limits import CLIENTS_MAX, HELLO_S, LINES_RESERVED, MESSAGES_PER_S, Close

from .client import HOST, OURS, TestClient, closed_with, enter, hello


@pytest.mark.parametrize(
    "first",
    [
        '{"kind":"beat"}',
        "{",
        '{"kind":"hello","ticket":"wrong","page":"page-of-a-test"}',
        '{"kind":"do","id":"12345678","made":1,"act":{"kind":"stop"}}',
    ],
)
def test_a_line_whose_first_words_hold_no_ticket_is_closed_with_4401(client: TestClient, hub: Hub, first: str):
    enter(client, hub, Role.OPERATOR)
    with client.websocket_connect(f"ws://{HOST}/operator/line", headers=OURS) as socket:
        socket.send_text(first)
        assert closed_with(socket) == Close.UNAUTHORISED
    assert hub.lines == {}


def test_a_line_that_says_nothing_is_closed_with_4401(client: TestClient, hub: Hub, monkeypatch: pytest.MonkeyPatch):
    assert HELLO_S == 2.0
    monkeypatch.setattr(line_module, "HELLO_S", 0.05)
    enter(client, hub, Role.OPERATOR)
    with client.websocket_connect(f"ws://{HOST}/operator/line", headers=OURS) as socket:
        assert closed_with(socket) == Close.UNAUTHORISED


def test_a_page_that_is_loaded_again_and_again_before_it_says_anything_locks_nobody_out(client: TestClient, hub: Hub):
    enter(client, hub, Role.VIEWER)
    for _ in range(8):
        with client.websocket_connect(f"ws://{HOST}/viewer/line", headers=OURS):
            pass
    with client.websocket_connect(f"ws://{HOST}/viewer/line", headers=OURS) as socket:
        socket.send_text(hello(client, Role.VIEWER))
        assert socket.receive_json()["kind"] == "welcome"


def test_a_ticket_opens_one_line(client: TestClient, hub: Hub):
    enter(client, hub, Role.VIEWER)
    first = hello(client, Role.VIEWER)
    with client.websocket_connect(f"ws://{HOST}/viewer/line", headers=OURS) as socket:
        socket.send_text(first)
        assert socket.receive_json()["kind"] == "welcome"
    with client.websocket_connect(f"ws://{HOST}/viewer/line", headers=OURS) as socket:
        socket.send_text(first)
        assert closed_with(socket) == Close.UNAUTHORISED


def test_viewers_take_no_line_that_another_role_has_reserved_and_there_is_no_ninth_line(client: TestClient, hub: Hub):
    assert set(LINES_RESERVED) == set(Role) - {Role.VIEWER}
    for role in Role:
        enter(client, hub, role)
    with contextlib.ExitStack() as stack:

        def is_welcome(role: Role) -> bool:
            try:
                line = client.websocket_connect(f"ws://{HOST}/{role.value}/line", headers=OURS)
                socket = stack.enter_context(line)
            except WebSocketDisconnect:
                return False
            socket.send_text(hello(client, role))
            return socket.receive_json()["kind"] == "welcome"

        viewers = CLIENTS_MAX - sum(LINES_RESERVED.values())
        assert [is_welcome(Role.VIEWER) for _ in range(CLIENTS_MAX)].count(True) == viewers
        for role, most in LINES_RESERVED.items():
            assert [is_welcome(role) for _ in range(most + 1)] == [True] * most + [False]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("{", Close.PROTOCOL),
        (b"\x00\x01", Close.PROTOCOL),
        ('{"kind":"beat","more":1}', Close.POLICY),
        ('{"kind":"hello","ticket":"x","page":"page-of-a-test"}', Close.POLICY),
        ('{"kind":"do","id":"12345678","made":1,"act":{"kind":"engage"}}', Close.POLICY),
        ('{"kind":"do","id":"12345678","made":1,"act":{"kind":"stop","more":1}}', Close.POLICY),
        ('{"kind":"beat","x":"' + "a" * 20_000 + '"}', Close.TOO_BIG),
    ],
)
def test_a_line_that_is_misused_is_closed_with_its_code_and_counted(
    client: TestClient, hub: Hub, text: str | bytes, why: Close
):
    enter(client, hub, Role.OPERATOR)
    with client.websocket_connect(f"ws://{HOST}/operator/line", headers=OURS) as socket:
        socket.send_text(hello(client, Role.OPERATOR))
        socket.send_bytes(text) if isinstance(text, bytes) else socket.send_text(text)
        assert closed_with(socket) == why
    assert hub.counts == {why.name: 1}


def test_more_than_fifty_messages_in_a_second_close_the_line(client: TestClient, hub: Hub):
    enter(client, hub, Role.VIEWER)
    with client.websocket_connect(f"ws://{HOST}/viewer/line", headers=OURS) as socket:
        socket.send_text(hello(client, Role.VIEWER))
        for number in range(MESSAGES_PER_S + 1):
            socket.send_text(json.dumps({"kind": "ping", "asked": float(number)}))
        assert closed_with(socket) == Close.POLICY
