"""A flood of connections before or after a login takes no connection, log or time from other pages."""

import json
import logging
import socket
import ssl
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path

import pytest
from tests.waiting import wait_until

from exograv.console import door, line_protocol
from exograv.console.door import ASKERS_OF_ADDRESS, CONNECTIONS_OF_ROLE, SILENT_OF_ADDRESS
from exograv.console.keys import Role, TokenUse
from exograv.console.log_limit import MESSAGES_MAX, PERIOD_S, LogLimit
from exograv.console.turnstile import Turnstile

from .of_clock import SetClock
from .of_process import Page
from .serving import Served, network_address, served

OPEN_S = 5.0
MANY = 3 * SILENT_OF_ADDRESS


@pytest.fixture
def house(tmp_path: Path) -> Iterator[Served]:
    with served(tmp_path, None) as running:
        yield running


class Connections:
    """TCP connections that do what a page would not do."""

    def __init__(self, house: Served, stack: ExitStack):
        host, port = house.hub.origin.partition("://")[2].split(":")
        self._place, self._stack, self.opened = (host, int(port)), stack, list[socket.socket]()

    def open(self, count: int, said: bytes = b"") -> None:
        for _ in range(count):
            one = self._stack.enter_context(socket.create_connection(self._place, OPEN_S))
            if said:
                one.sendall(said)
            one.setblocking(False)
            self.opened.append(one)

    @property
    def alive(self) -> int:
        """Number of connections that the server has not closed; answers are read."""
        return sum(map(is_alive, self.opened))


def is_alive(one: socket.socket) -> bool:
    try:
        while one.recv(4096):
            pass
        return False
    except BlockingIOError:
        return True
    except OSError:
        return False


def cookie_of(house: Served, role: Role) -> str:
    keys = house.hub.keys
    entered = keys.enter(keys.token(role), "127.0.0.1")
    assert not isinstance(entered, TokenUse)
    return f"exograv-{role.value}-{house.hub.origin.rpartition(':')[2]}={entered[1]}"


def page_of(house: Served, role: Role, cookie: str) -> int:
    """Status of a role's page."""
    asked = urllib.request.Request(f"{house.hub.origin}/{role.value}/", headers={"Cookie": cookie})
    try:
        with urllib.request.urlopen(asked, timeout=OPEN_S) as answer:
            return answer.status
    except urllib.error.HTTPError as error:
        return error.code


def test_idle_connections_are_closed_beyond_a_limit_and_a_page_still_gets_in(house: Served):
    with ExitStack() as stack:
        flood = Connections(house, stack)
        flood.open(MANY)
        wait_until(lambda: flood.alive <= SILENT_OF_ADDRESS)
        assert flood.alive > 0
        with Page(house.link(Role.OPERATOR)) as operator:
            flood.open(MANY)
            assert operator.act("stop")["taken"]


def test_of_many_idle_connections_the_newest_stay(house: Served):
    with ExitStack() as stack:
        flood = Connections(house, stack)
        flood.open(SILENT_OF_ADDRESS + 10)
        wait_until(lambda: flood.alive <= SILENT_OF_ADDRESS)
        assert [is_alive(one) for one in flood.opened] == [False] * 10 + [True] * SILENT_OF_ADDRESS


@pytest.mark.parametrize("said", [b"", b"GET / HTTP/1.1\r\nHost: "])
def test_a_connection_without_a_whole_request_is_closed_in_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, said: bytes
):
    assert door.REQUEST_S == 5.0
    monkeypatch.setattr(door, "REQUEST_S", 0.1)
    monkeypatch.setattr(door, "SWEEP_S", 0.02)
    with served(tmp_path, None) as house, ExitStack() as stack:
        slow = Connections(house, stack)
        slow.open(3, said)
        wait_until(lambda: slow.alive == 0)


def test_a_connection_that_never_logs_in_is_closed_in_time_although_it_asks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(door, "NEWCOMER_S", 0.3)
    monkeypatch.setattr(door, "REQUEST_S", 1000.0)
    monkeypatch.setattr(door, "SWEEP_S", 0.02)
    with served(tmp_path, None) as house, ExitStack() as stack:
        host = house.hub.origin.removeprefix("http://")
        slow = Connections(house, stack)
        slow.open(3, f"GET /enter HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        wait_until(lambda: slow.alive == 0, seconds=3.0)  # an idle connection with an answer ends after 5 s


def test_half_first_messages_of_tls_handshakes_do_not_keep_a_page_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(door, "REQUEST_S", 1000.0)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
    context.check_hostname, context.verify_mode = False, ssl.CERT_NONE
    with served(tmp_path, None, address=network_address(tmp_path)) as house, ExitStack() as stack:
        flood = Connections(house, stack)
        for said in ((hello := hello_of(context))[:-1], hello[:3], b"GET / HTTP/1.1\r\n\r\n"):
            flood.open(MANY, said)
            wait_until(lambda: is_open_to(house, context))
        wait_until(lambda: flood.alive <= SILENT_OF_ADDRESS)


def is_open_to(house: Served, context: ssl.SSLContext) -> bool:
    try:
        with urllib.request.urlopen(house.hub.origin, None, 0.5, context=context) as answer:
            return answer.status == 200
    except OSError:
        return False


def hello_of(context: ssl.SSLContext) -> bytes:
    """First message of a handshake."""
    sent = ssl.MemoryBIO()
    with suppress(ssl.SSLWantReadError):
        context.wrap_bio(ssl.MemoryBIO(), sent).do_handshake()
    return sent.read()


def test_a_door_that_accepts_no_more_connections_ends_the_server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def fail(_door: door.Door, client: socket.socket, _address: str) -> None:
        client.close()
        raise MemoryError

    with served(tmp_path, None) as house, ExitStack() as stack:
        monkeypatch.setattr(door.Door, "_receive", fail)
        Connections(house, stack).open(1)
        wait_until(lambda: isinstance(house.hub.failure, MemoryError))


@pytest.mark.parametrize("said", [b"\x16\x03\x01\x00\r\n\r\n", b"GET /\r\n\r\n", b"BREW /pot HTTP/1.1\r\n\r\n"])
def test_what_is_no_request_is_closed_without_an_answer(house: Served, said: bytes):
    with ExitStack() as stack:
        odd = Connections(house, stack)
        odd.open(3, said)
        wait_until(lambda: odd.alive == 0)


def test_a_login_and_a_correct_link_do_not_wait_behind_other_requests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    with served(tmp_path, None) as house, ExitStack() as stack:
        cookie = cookie_of(house, Role.OPERATOR)
        # No request without a login is handed to the server any more.
        (lane,) = [each._strangers for each in house.server.servers]  # pyright: ignore[reportAttributeAccessIssue]
        monkeypatch.setattr(lane, "add", lambda _visit: None)
        Connections(house, stack).open(ASKERS_OF_ADDRESS, b"GET / HTTP/1.1\r\nHost: x\r\n\r\n")
        assert page_of(house, Role.OPERATOR, cookie) == 200
        with Page(house.link(Role.VIEWER)) as viewer:
            assert viewer.act("stop")["taken"]


def test_connections_of_one_viewer_beyond_the_limit_are_refused_and_an_operator_gets_in(house: Served):
    viewer, operator = cookie_of(house, Role.VIEWER), cookie_of(house, Role.OPERATOR)
    host = house.hub.origin.removeprefix("http://")
    asked = f"GET /viewer/ HTTP/1.1\r\nHost: {host}\r\nCookie: {viewer}\r\n\r\n".encode()
    with ExitStack() as stack:
        flood = Connections(house, stack)
        flood.open(CONNECTIONS_OF_ROLE[Role.VIEWER], asked)
        wait_until(lambda: all(one_has_an_answer(one) for one in flood.opened))
        assert page_of(house, Role.VIEWER, viewer) == 503
        assert page_of(house, Role.OPERATOR, operator) == 200
    wait_until(lambda: page_of(house, Role.VIEWER, viewer) == 200)


def one_has_an_answer(one: socket.socket) -> bool:
    try:
        return one.recv(1, socket.MSG_PEEK) != b""
    except BlockingIOError:
        return False


def frame_of(text: str) -> bytes:
    """WebSocket frame of a client, with a mask of zeros."""
    data = text.encode()
    return b"\x81\xfe" + len(data).to_bytes(2, "big") + bytes(4) + data


def test_a_line_that_goes_on_after_its_close_ends_at_once(house: Served, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(line_protocol, "BYTES_AT_ONCE", 10**12)
    host = house.hub.origin.removeprefix("http://")
    head = (
        f"GET /viewer/line HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nUpgrade: websocket\r\n"
        f"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
        f"Cookie: {cookie_of(house, Role.VIEWER)}\r\n\r\n"
    )
    place = host.split(":")
    with socket.create_connection((place[0], int(place[1])), OPEN_S) as wire:
        wire.sendall(head.encode())
        assert wire.recv(4096).startswith(b"HTTP/1.1 101")
        # The first message is no hello. The server closes the line, and an ordinary page answers with a close.
        with pytest.raises(ConnectionError):
            wire.sendall(frame_of("a" * 256) * 80_000)


def test_a_correct_link_opens_while_wrong_ones_come_from_the_same_address(house: Served):
    def status(token: str) -> int:
        headers = {"X-Exograv": "1", "Origin": house.hub.origin}
        body = json.dumps({"token": token}).encode()
        try:
            with urllib.request.urlopen(
                urllib.request.Request(f"{house.hub.origin}/enter", body, headers), timeout=OPEN_S
            ) as entered:
                return entered.status
        except urllib.error.HTTPError as error:
            return error.code

    assert [status("wrong") for _ in range(7)] == [403] * 5 + [429] * 2
    assert status(house.hub.keys.token(Role.OPERATOR)) == 200


def test_a_flood_of_nonsense_writes_a_few_lines_to_the_log(house: Served, caplog: pytest.LogCaptureFixture):
    with caplog.at_level(logging.WARNING), ExitStack() as stack:
        flood = Connections(house, stack)
        flood.open(3 * MESSAGES_MAX, b"GET / HTTP/1.1\r\nno header\r\n\r\n")
        wait_until(lambda: flood.alive == 0 or all(map(one_has_an_answer, flood.opened)))
    assert 0 < len(caplog.records) <= MESSAGES_MAX


def test_the_log_says_how_many_messages_were_left_out():
    clock = SetClock()
    limit = LogLimit(clock)
    records = [logging.LogRecord("x", logging.WARNING, "", 1, "odd %d", (number,), None) for number in range(25)]
    assert [limit.filter(record) for record in records] == [True] * MESSAGES_MAX + [False] * (25 - MESSAGES_MAX)
    clock.t += PERIOD_S
    later = logging.LogRecord("x", logging.WARNING, "", 1, "odd %d", (99,), None)
    assert limit.filter(later)
    assert later.getMessage() == "odd 99 (15 messages before this one were left out.)"


def test_a_source_that_sends_too_fast_waits_for_itself_only_and_in_order():
    turnstile = Turnstile(per_s=10.0, at_once=3)
    waits = [turnstile.wait_s("flood", 0.0) for _ in range(6)]
    assert waits == pytest.approx([0.0, 0.0, 0.0, 0.0, 0.1, 0.2])
    assert turnstile.wait_s("page", 0.0) == 0.0
    assert turnstile.wait_s("flood", 10.0) == 0.0


def test_no_number_of_sources_fills_the_memory_of_the_turnstile():
    turnstile = Turnstile(per_s=10.0, at_once=3)
    for number in range(3000):
        turnstile.wait_s(number, float(number))
    assert len(turnstile._due) < 1100
