"""A real server refuses what uvicorn must refuse, needs a certificate in a network, and ends."""

import asyncio
import json
import socket
import ssl
import time
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest
import uvicorn
from websockets.exceptions import ConnectionClosed, InvalidState, InvalidStatus
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin

from exograv.console.hub import Hub
from exograv.console.keys import Role, TokenUse
from exograv.console.limits import MESSAGE_MAX_BYTES, Close
from exograv.console.line_protocol import BYTES_AT_ONCE
from exograv.console.options import Address
from exograv.console.serve import PageServer, bound, settings_of
from exograv.console.trial import ProtocolTrial
from exograv.errors import ConfigError

from .fake_desk import FakeDesk
from .serving import Served, hub_on, network_address, served

OPEN_S = 5.0


@contextmanager
def line(house: Served, role: Role = Role.VIEWER, compression: str | None = None) -> Iterator[ClientConnection]:
    """Open a line of a logged-in page, up to its welcome."""
    keys = house.hub.keys
    entered = keys.enter(keys.token(role), "127.0.0.1")
    assert not isinstance(entered, TokenUse)
    session = keys.session(role, entered[1])
    assert session is not None
    origin = Origin(house.hub.origin)
    cookie = f"exograv-{role.value}-{origin.rpartition(':')[2]}={entered[1]}"
    url = f"ws://{origin.removeprefix('http://')}/{role.value}/line"
    with connect(
        url, origin=origin, additional_headers={"Cookie": cookie}, open_timeout=OPEN_S, compression=compression
    ) as opened:
        opened.send(json.dumps({"kind": "hello", "ticket": keys.ticket(session), "page": "page-of-a-test"}))
        assert json.loads(opened.recv(OPEN_S))["kind"] == "welcome"
        yield opened


def closed_with(opened: ClientConnection) -> int | None:
    """Read until the server closes the line; return the close code."""
    try:
        while True:
            opened.recv(OPEN_S)
    except ConnectionClosed as end:
        return end.rcvd.code if end.rcvd else None


@pytest.fixture
def house(tmp_path: Path):
    with served(tmp_path, None) as running:
        yield running


def test_a_frame_beyond_16_kib_is_not_even_read_to_its_end(house: Served):
    with line(house) as opened:
        opened.send("a" * (MESSAGE_MAX_BYTES + 1))
        assert closed_with(opened) == Close.TOO_BIG


def test_a_message_in_fragments_is_not_longer_than_one_in_one(house: Served):
    with line(house) as opened:
        # No fragment follows the one that is too much: unread bytes would reset the line, and the code would be lost.
        opened.send(["a" * 10_000] * 2)
        assert closed_with(opened) == Close.TOO_BIG


def test_a_line_that_floods_control_frames_ends(house: Served):
    def flood(opened: ClientConnection) -> None:
        for number in range(2 * BYTES_AT_ONCE // 125):
            opened.ping(f"{number:0125d}")

    with line(house) as opened, pytest.raises(ConnectionClosed):
        flood(opened)


def test_compression_is_not_agreed_to(house: Served):
    with line(house, compression="deflate") as opened:
        assert "sec-websocket-extensions" not in opened.response.headers  # pyright: ignore[reportOptionalMemberAccess]


@pytest.mark.parametrize("origin", [None, Origin("http://evil.example")])
def test_no_upgrade_without_our_own_origin(house: Served, origin: Origin | None):
    url = house.hub.origin.replace("http", "ws") + "/viewer/line"
    with (
        pytest.raises(InvalidStatus) as refused,
        connect(url, origin=origin),
    ):
        pass
    assert refused.value.response.status_code == 403


def test_no_upgrade_without_a_cookie(house: Served):
    url = house.hub.origin.replace("http", "ws") + "/viewer/line"
    with pytest.raises(InvalidStatus) as refused, connect(url, origin=Origin(house.hub.origin)):
        pass
    assert refused.value.response.status_code == 403


def test_the_server_does_not_say_what_it_is(house: Served):
    with urllib.request.urlopen(house.hub.origin + "/") as response:
        assert "server" not in {name.lower() for name in response.headers}


def test_a_page_that_reads_nothing_keeps_nobody_waiting(house: Served):
    with line(house) as slow, line(house) as quick:
        slow.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        begun = time.monotonic()
        for number in range(5):
            quick.send(json.dumps({"kind": "ping", "asked": float(number)}))
            while json.loads(quick.recv(OPEN_S))["kind"] != "pong":
                pass
        assert time.monotonic() - begun < OPEN_S


def test_the_server_ends_with_lines_open(tmp_path: Path):
    with ExitStack() as stack:
        with served(tmp_path, None) as house:
            opened = stack.enter_context(line(house))
            begun = time.monotonic()
        assert time.monotonic() - begun < OPEN_S
        assert closed_with(opened) is not None


def test_no_answer_waits_for_the_acknowledgement_of_the_one_before(house: Served):
    with line(house):
        connections: Any = house.server.server_state.connections
        sockets = [each.transport.get_extra_info("socket") for each in connections]
        assert [one.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY) for one in sockets] == [1]


def test_only_this_computer_is_listened_on_without_a_certificate():
    with bound(Address(port=0)) as (listening, host):
        assert listening.getsockname()[0] == "127.0.0.1"
        assert host.startswith("127.0.0.1:")


@pytest.mark.parametrize(
    ("address", "what"),
    [
        (Address(port=0, lan="127.0.0.2"), "--certificate"),
        (Address(port=0, lan="127.0.0.2", certificate=Path("c.pem")), "--certificate"),
        (Address(port=0, lan="127.0.0.2", certificate=Path("no.pem"), key=Path("no.pem")), "not a certificate"),
        (Address(port=0, lan="0.0.0.0", certificate=Path("c.pem"), key=Path("k.pem")), "one address"),
        (Address(port=0, certificate=Path("c.pem")), "--lan"),
        (Address(port=70_000), "--port"),
    ],
)
def test_what_would_be_open_to_others_in_clear_is_refused(address: Address, what: str):
    with pytest.raises(ConfigError, match=what), bound(address):
        pass


def test_a_port_that_somebody_has_is_told():
    with bound(Address(port=0)) as (listening, host):
        listening.listen()
        with pytest.raises(ConfigError, match="cannot be used"), bound(Address(port=int(host.rpartition(":")[2]))):
            pass


def test_in_a_network_pages_come_over_tls_under_one_name(tmp_path: Path):
    address = network_address(tmp_path)
    with bound(address) as (listening, host), hub_on(FakeDesk(), tmp_path, None, f"https://{host}") as hub:
        config = settings_of(hub, address, host)
        config.load()
        assert config.is_ssl
        assert isinstance(config.ssl, ssl.SSLContext)
        assert listening.getsockname()[0] == "127.0.0.2"


def test_the_end_of_the_server_breaks_off_a_window_that_the_clock_would_close_later(
    hub: Hub, monkeypatch: pytest.MonkeyPatch
):
    async def closing(_server: uvicorn.Server, _sockets: list[socket.socket] | None = None) -> None: ...

    monkeypatch.setattr(uvicorn.Server, "shutdown", closing)
    trial = Mock(spec=ProtocolTrial)
    monkeypatch.setattr(hub, "trial", trial)
    server = PageServer(uvicorn.Config(lambda: None), hub)
    server.says_farewell = False  # another process replaces this one
    asyncio.run(server.shutdown())
    trial.interrupt.assert_not_called()
    server.says_farewell = True
    asyncio.run(server.shutdown())
    trial.interrupt.assert_called_once()


def test_a_page_that_closes_its_line_during_the_shutdown_is_no_error(hub: Hub, monkeypatch: pytest.MonkeyPatch):
    attempts = list[int]()

    async def closing_twice(_server: uvicorn.Server, _sockets: list[socket.socket] | None = None) -> None:
        attempts.append(1)
        if len(attempts) < 3:
            raise InvalidState("connection is closing")

    monkeypatch.setattr(uvicorn.Server, "shutdown", closing_twice)
    asyncio.run(PageServer(uvicorn.Config(lambda: None), hub).shutdown())
    assert len(attempts) == 3
