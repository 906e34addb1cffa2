"""A parent never waits for a child that hangs in the middle of a message, floods its line, or reads nothing."""

import os
import struct
import sys
import time
from collections.abc import Iterator
from multiprocessing import Pipe
from multiprocessing.connection import Connection

import pytest

from exograv.runtime.processes.process_line import LOOK_BYTES, UNSENT_MAX_BYTES, BrokenLineError, ProcessLine
from exograv.runtime.processes.supervisor import Supervisor

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Pipes of Windows carry whole messages only.")
SOON_S, MESSAGE_BYTES = 30.0, 1_000_000


@pytest.fixture
def ends() -> Iterator[tuple[ProcessLine, Connection]]:
    ours, theirs = Pipe()
    line = ProcessLine(ours)
    yield line, theirs
    line.close()
    theirs.close()


Ends = tuple[ProcessLine, Connection]


def test_half_a_message_is_no_message_and_the_rest_completes_it(ends: Ends):
    line, child = ends
    child.send("whole")
    data = struct.pack("!i", 1000) + b"half"
    os.write(child.fileno(), data)
    assert list(line.words()) == ["whole"]
    assert list(line.words()) == []
    assert line.next_word(0.0) is None


def test_a_message_that_comes_in_parts_is_read(ends: Ends):
    line, child = ends
    copy, other = Pipe()
    copy.send({"level": 0.5})
    data = os.read(other.fileno(), 1000)
    os.write(child.fileno(), data[:6])
    assert line.next_word(0.0) is None
    os.write(child.fileno(), data[6:])
    assert line.next_word(SOON_S) == {"level": 0.5}


def test_messages_for_a_child_that_reads_nothing_are_kept_and_arrive_in_their_order(ends: Ends):
    line, child = ends
    words = [bytes([number]) * MESSAGE_BYTES for number in range(4)]
    for word in words:
        line.send(word)
    assert line.has_unsent
    # `Connection.recv` would wait for the rest of a message, which only this thread sends.
    reader, came = ProcessLine(child), []
    while len(came) < len(words):
        line.flush()
        came += reader.words()
    assert came == words
    assert not line.has_unsent


def test_a_child_that_never_reads_costs_a_limited_amount_of_memory(ends: Ends):
    line, _ = ends
    for _ in range(UNSENT_MAX_BYTES // MESSAGE_BYTES + 10):
        line.send(bytes(MESSAGE_BYTES))
    assert len(line._unsent) <= UNSENT_MAX_BYTES + 4


@pytest.mark.parametrize("data", [struct.pack("!i", -7), struct.pack("!i", 0), struct.pack("!i", 4) + b"none"])
def test_bytes_that_are_no_message_break_the_line(ends: Ends, data: bytes):
    line, child = ends
    os.write(child.fileno(), data)
    with pytest.raises(BrokenLineError):
        list(line.words())


def test_the_end_of_a_child_is_heard_after_its_last_message(ends: Ends):
    line, child = ends
    child.send("last")
    child.close()
    words = line.words()
    assert next(words) == "last"
    with pytest.raises(EOFError):
        next(words)
    with pytest.raises(EOFError):
        line.next_word(0.0)


def floods(_job: object, parent: Connection) -> None:
    while True:
        parent.send(bytes(MESSAGE_BYTES))


def sends_half(_job: object, parent: Connection) -> None:
    os.write(parent.fileno(), struct.pack("!i", 1000) + b"half")
    time.sleep(600.0)


def sends_garbage(_job: object, parent: Connection) -> None:
    os.write(parent.fileno(), struct.pack("!i", -7))
    time.sleep(600.0)


def test_a_child_that_floods_its_line_keeps_its_parent_for_one_look_at_a_time():
    child = Supervisor("child", floods, None)
    assert child.next_word(SOON_S) is not None
    list(child.heard())  # `next_word` may have read further messages
    for _ in range(20):
        assert len(list(child.heard())) <= LOOK_BYTES // MESSAGE_BYTES + 1
    child.end(0.0)


def test_a_child_that_sends_half_a_message_is_no_reason_to_wait():
    child = Supervisor("child", sends_half, None)
    assert child.next_word(2.0) is None
    assert list(child.heard()) == []
    assert child.is_alive
    child.end(0.0)


def test_a_child_that_sends_anything_but_messages_is_killed():
    child = Supervisor("child", sends_garbage, None)
    until = time.monotonic() + SOON_S
    while not child.has_hung_up and time.monotonic() < until:
        assert list(child.heard()) == []
    assert child.exit_status == -9
    child.end(0.0)


def test_a_system_whose_pipes_carry_whole_messages_gets_the_same_words(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(sys, "platform", "win32")
    ours, child = Pipe()
    line = ProcessLine(ours)
    assert line.next_word(0.0) is None
    for number in range(3):
        child.send(number)
    assert line.next_word(SOON_S) == 0
    assert list(line.words()) == [1, 2]
    line.send("answer")
    assert not line.has_unsent
    assert child.recv() == "answer"
    line.close()
    child.close()


def test_messages_that_wait_are_sent_while_the_parent_waits_for_a_word_and_when_it_looks(ends: Ends):
    line, child = ends
    for look in (lambda: line.next_word(0.0), lambda: list(line.words())):
        line.send(b"x" * MESSAGE_BYTES)
        assert line.has_unsent
        came = 0
        while came < MESSAGE_BYTES:
            came += len(os.read(child.fileno(), MESSAGE_BYTES))
            if line.has_unsent:
                look()
        while line.has_unsent:
            look()
            came += len(os.read(child.fileno(), MESSAGE_BYTES))


def test_a_closed_line_sends_nothing_any_more(ends: Ends):
    line, child = ends
    line.send(b"x" * MESSAGE_BYTES)
    line.close()
    line.flush()
    assert line.has_unsent
    while os.read(child.fileno(), MESSAGE_BYTES):
        pass
