"""Lines between two processes arrive whole and in order; a process that does not read ends the connection only."""

import contextlib
import socket
from collections.abc import Iterator

import pytest

from exograv.errors import RigError
from exograv.runtime.processes import line_socket
from exograv.runtime.processes.line_socket import LINE_MAX_BYTES, Lines, LinesListener, connected_lines

Pair = tuple[Lines, Lines]


@pytest.fixture
def pair() -> Iterator[Pair]:
    with contextlib.closing(LinesListener(0)) as listener:
        here = connected_lines(listener.port)
        there = listener.accepted()
        assert there is not None
        with here, there:
            yield here, there


def test_lines_arrive_whole_and_in_order(pair: Pair):
    here, there = pair
    sent = [f'{{"number": {number}, "text": "ä"}}' for number in range(200)]
    for line in sent:
        here.send(line)
    received: list[str] = []
    while len(received) < len(sent):
        received += there.received(patience_s=1.0)
    assert received == sent


@pytest.fixture
def raw() -> Iterator[tuple[socket.socket, Lines]]:
    """Socket of a process that sends any bytes, and the lines of the other process."""
    with (
        contextlib.closing(LinesListener(0)) as listener,
        socket.create_connection((line_socket.HERE, listener.port)) as one,
    ):
        lines = listener.accepted()
        assert lines is not None
        with lines:
            yield one, lines


def test_half_a_line_waits_for_its_end(raw: tuple[socket.socket, Lines]):
    one, lines = raw
    one.sendall(b"begun, ")
    assert lines.received(patience_s=1.0) == []
    one.sendall(b"ended\nnext")
    assert lines.received(patience_s=1.0) == ["begun, ended"]


def test_a_line_that_never_ends_ends_the_connection(raw: tuple[socket.socket, Lines]):
    one, lines = raw
    one.sendall(b"x" * (LINE_MAX_BYTES + 2))
    while lines.is_open and len(lines._begun) <= LINE_MAX_BYTES:
        lines.received(patience_s=1.0)
    assert not lines.is_open


def test_a_process_that_does_not_read_does_not_block_the_other_one(pair: Pair):
    here, _ = pair
    for _ in range(10_000):
        here.send("x" * 1000)
        if not here.is_open:
            return
    pytest.fail("Ten megabytes were accepted by a process that does not read.")


def test_the_end_of_the_other_process_is_seen(pair: Pair):
    here, there = pair
    there.send("last")
    there.close()
    assert here.received(patience_s=1.0) == ["last"]
    here.received()
    assert not here.is_open


def test_a_closed_line_has_nothing_to_receive_and_sends_nothing(pair: Pair):
    here, _ = pair
    here.close()
    assert here.received(patience_s=0.1) == []
    here.send("lost")
    assert not here.is_open


def test_a_port_that_is_taken_is_refused_with_a_reason():
    with contextlib.closing(LinesListener(0)) as listener, pytest.raises(RigError, match="cannot be listened at"):
        LinesListener(listener.port)


def test_nobody_at_the_port_is_a_clear_error(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(line_socket, "CONNECT_S", 0.1)
    with contextlib.closing(LinesListener(0)) as listener:
        port = listener.port
    with pytest.raises(RigError, match=f"port {port}"):
        connected_lines(port)


def test_a_listener_without_a_caller_has_no_connection_and_does_not_wait():
    with contextlib.closing(LinesListener(0)) as listener:
        assert listener.accepted() is None
