"""The pages' process reaches the desk by checked requests, and neither process ever waits for the other."""

import math
import time
from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import closing, contextmanager

import pytest
from tests.waiting import wait_until

from exograv.console.desk_link import Decide, DeskClient, DeskLink, Ended, Ready
from exograv.errors import RigError
from exograv.experiment.steered.rehearsal import RehearsedFlight
from exograv.experiment.steered.requests import LEASE_S, MakeReady, Stop
from exograv.experiment.steered.session_controller import SessionController
from exograv.recording.writer import encoded

from .fake_desk import FakeDesk
from .of_clock import SetClock


@contextmanager
def linked(desk: FakeDesk | SessionController) -> Iterator[tuple[DeskLink, DeskClient]]:
    """Both ends of a link; the client outlives the link, as a process of its own would."""
    with closing(DeskLink(desk)) as link:
        yield link, DeskClient(link.names)


def test_every_question_has_the_answer_of_the_desk():
    desk = FakeDesk()
    with linked(desk) as (_, client):
        assert client.shown().joints == desk.shown().joints
        assert client.trace(0).first == 0
        assert client.skeleton().q_rad
        act = MakeReady(id="a-name-of-8", made_at_s=client.now(), seen_version=desk.version)
        assert client.act(act, "therapist") == desk.answers[act.id]
        assert desk.asked == [(act, "therapist")]


def test_a_scene_is_sent_once_and_again_when_it_changes():
    desk = FakeDesk()
    with linked(desk) as (_, client):
        first = client.scene()
        assert first == desk.scene()
        assert client.scene() is first
        desk.side = "left"
        again = client.scene()
        assert again is not None
        assert again.side == "left"


def test_a_message_and_a_heartbeat_reach_the_desk_without_an_answer():
    desk = FakeDesk()
    with linked(desk) as (_, client):
        client.write("/console/event", 3.5, {"what": "line opened", "line": 1})
        client.keep(12.5)
        wait_until(lambda: desk.written and desk.kept)
    assert desk.written == [("/console/event", 3.5, {"what": "line opened", "line": 1})]
    assert desk.kept == [12.5]


def test_the_last_messages_of_a_process_that_has_ended_are_recorded():
    desk = FakeDesk()
    with linked(desk) as (link, client):
        for number in range(100):
            client.write("/console/event", float(number), {"what": "a"})
        client.send(Ready(aircraft_port=None))
        client.send(Ended(refused_lines={"POLICY": 2}, totals=None))
    assert len(desk.written) == 100
    assert link.ready is not None
    assert link.ended == Ended(refused_lines={"POLICY": 2}, totals=None)


@pytest.mark.parametrize(
    "data",
    [
        b"{",
        b"\x80\x04K\x01.",
        b'{"what":"close"}',
        b'{"what":"act","number":1,"by":"admin","act":{"kind":"stop","id":"a-name-of-8","made_at_s":1}}',
        b'{"what":"keep","heard_s":NaN,"window_left_s":null}',
        b'{"what":"write","topic":"/../x","t":1,"message":{}}',
    ],
)
def test_a_request_that_is_not_valid_reaches_no_desk_and_breaks_the_link(data: bytes):
    desk = FakeDesk()
    with linked(desk) as (link, client):
        client._requests.put_bytes(data)
        wait_until(lambda: link.why_broken)
        client.keep()
    assert (desk.asked, desk.kept, desk.written) == ([], [], [])


def test_a_message_that_the_recording_cannot_hold_breaks_the_link_and_not_the_desk(monkeypatch: pytest.MonkeyPatch):
    desk = FakeDesk()
    monkeypatch.setattr(desk, "write", encoded)
    with linked(desk) as (link, client):
        client.write("/page", 1.0, {"topic": "/a", "message": {"a": math.nan}})
        wait_until(lambda: link.why_broken)
    assert link.failure is None


def test_a_desk_that_fails_is_told_to_both_sides(monkeypatch: pytest.MonkeyPatch):
    desk = FakeDesk()

    def fail():
        raise ZeroDivisionError("of a test")

    monkeypatch.setattr(desk, "shown", fail)
    with linked(desk) as (link, client):
        with pytest.raises(RigError, match="of a test"):
            client.shown()
        assert isinstance(link.failure, ZeroDivisionError)


def test_a_stop_waits_for_no_other_act(monkeypatch: pytest.MonkeyPatch):
    desk, decide = FakeDesk(), Decide(number=1, act=Stop(id="stop-of-8", made_at_s=0.0), by="viewer")
    act = desk.act

    def slow(asked: object, by: object):
        if not isinstance(asked, Stop):
            wait_until(lambda: any(isinstance(each, Stop) for each, _ in desk.asked), "a stop")
        return act(asked, by)  # pyright: ignore[reportArgumentType] - both are those of the desk

    monkeypatch.setattr(desk, "act", slow)
    with linked(desk) as (_, client):
        for number in range(4):
            client._asked[100 + number] = Future()
            request = MakeReady(id=f"other-{number:03d}", made_at_s=0.0, seen_version=1)
            client._put(Decide(number=100 + number, act=request, by="operator").model_dump(mode="json"))
        assert client.act(decide.act, "viewer").taken


def test_a_parent_that_takes_nothing_makes_no_writer_wait():
    with linked(FakeDesk()) as (link, client):
        link._is_closed.set()
        link._thread.join()
        while client._put({"what": "write", "topic": "/a", "t": 0.0, "message": {"a": "x" * 3000}}):
            pass
        client.write("/a", 0.0, {"a": "x" * 9000})
        assert client.lost == 1
        link._take_all()


def test_a_heartbeat_that_waited_counts_from_when_it_was_heard():
    clock = SetClock()
    desk = SessionController(RehearsedFlight(clock))
    desk.keep(heard_s=clock.t - 0.7)
    assert desk.shown().lease_left_s == pytest.approx(LEASE_S - 0.7)
    clock.t += LEASE_S - 0.6
    assert desk.shown().lease_left_s is None
    desk.keep(heard_s=clock.t + 5.0)
    assert desk.shown().lease_left_s == pytest.approx(LEASE_S)


def test_a_lease_that_ended_and_began_again_between_two_looks_is_an_alarm():
    clock = SetClock()
    desk = SessionController(RehearsedFlight(clock))
    desk.keep()
    desk.shown()
    clock.t += LEASE_S + 0.1
    desk.keep()
    alarms = [alarm for alarm in desk.shown().alarms if "No operator steers" in alarm.text]
    assert [alarm.is_over for alarm in alarms] == [True]
    assert len([alarm for alarm in desk.shown().alarms if "No operator steers" in alarm.text]) == 1


def test_the_clock_of_both_processes_is_the_same():
    with linked(SessionController(RehearsedFlight())) as (_, client):
        assert client.now() <= time.monotonic()
        assert client.shown().t <= client.now()
