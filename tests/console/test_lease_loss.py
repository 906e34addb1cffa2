"""A page that loses the right to steer, and the person in the machine, are told the cause and what to do next."""

import json
from typing import Any, get_args

import pytest

from exograv.console.broadcaster import Broadcaster
from exograv.console.handlers import hear
from exograv.console.hub import Hub, PageLine
from exograv.console.keys import Role
from exograv.console.lease import LEASE_S
from exograv.console.lease_loss import SERVER_SLOW_S, Cause
from exograv.console.limits import Close
from exograv.console.page_files import PAGES

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import page, run, told
from .test_broadcaster import rounds, shown
from .test_handlers import floating

LANGUAGES = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (PAGES / "words").glob("*.json")}
SILENT_S = LEASE_S + 0.3


def beat(hidden: bool = False, **gap: Any) -> dict[str, Any]:
    return {"kind": "beat", "hidden": hidden} | ({"gap": gap} if gap else {})


def alarms(hub: Hub) -> list[str]:
    return [alarm.text for alarm in hub.alarms.open]


def shown_cause(hub: Hub) -> str | None:
    """Cause that a viewer's page shows."""
    lost = shown(hub, Role.VIEWER)["state"][-1]["lost"]
    return None if lost is None else lost["cause"]


@pytest.fixture
def operator(house: Hub, desk: FakeDesk, clock: SetClock) -> PageLine:
    operator = floating(house, desk, clock)
    page(house, Role.VIEWER, clock)
    page(house, Role.PARTICIPANT, clock)
    return operator


def test_while_a_page_steers_no_loss_is_shown(house: Hub, operator: PageLine, clock: SetClock):
    news = None
    for _ in range(20):
        told(house, operator, beat())
        news = rounds(house, clock, 0.15, news)
    assert shown_cause(house) is None
    assert shown(house, Role.PARTICIPANT)["picture"][-1]["notice"] is None


def test_silence_is_told_to_operator_and_participant_with_the_next_step(
    house: Hub, operator: PageLine, clock: SetClock
):
    rounds(house, clock, SILENT_S)
    (text,) = alarms(house)
    assert text == shown(house, Role.VIEWER)["state"][-1]["lost"]["text"]["text"]
    assert "was silent for 1.2 s" in text
    assert "press Steer" in text
    assert shown(house, Role.PARTICIPANT)["picture"][-1]["notice"] == "silent"


@pytest.mark.parametrize("cause", ["slow", "asleep", "hidden"])
def test_a_page_that_is_back_says_what_it_was_and_the_alarm_says_it_too(
    house: Hub, operator: PageLine, clock: SetClock, cause: str
):
    news = rounds(house, clock, SILENT_S)
    told(house, operator, beat(cause=cause, seconds=4.5))
    rounds(house, clock, 0.2, news)
    assert shown_cause(house) == cause
    (text,) = alarms(house)
    assert {"slow": "too slow (4.5 s", "asleep": "slept for 4.5 s", "hidden": "in the background"}[cause] in text
    assert shown(house, Role.PARTICIPANT)["picture"][-1]["notice"] == cause


def test_only_the_page_that_lost_the_lease_may_explain_it(house: Hub, operator: PageLine, clock: SetClock):
    other = page(house, Role.OPERATOR, clock)
    news = rounds(house, clock, SILENT_S)
    told(house, other, beat(cause="asleep", seconds=60.0))
    rounds(house, clock, 0.2, news)
    assert shown_cause(house) == "silent"


def test_a_page_in_the_background_is_the_cause_before_it_is_back(house: Hub, operator: PageLine, clock: SetClock):
    told(house, operator, beat(hidden=True))
    rounds(house, clock, SILENT_S)
    assert shown_cause(house) == "hidden"


def test_a_server_that_is_late_itself_does_not_blame_the_page(house: Hub, operator: PageLine, clock: SetClock):
    told(house, operator, beat())
    news = rounds(house, clock, 0.1)
    clock.t += SERVER_SLOW_S + 0.1
    rounds(house, clock, SILENT_S, news)
    assert shown_cause(house) == "server_slow"


def test_a_delay_of_the_server_before_the_last_heartbeat_explains_nothing(
    house: Hub, operator: PageLine, clock: SetClock
):
    news = rounds(house, clock, 0.1)
    clock.t += SERVER_SLOW_S + 0.1
    told(house, operator, beat())
    news = rounds(house, clock, 0.03, news)
    told(house, operator, beat())
    rounds(house, clock, SILENT_S, news)
    assert shown_cause(house) == "silent"


@pytest.mark.parametrize(("end", "cause"), [(None, "closed"), (Close.POLICY, "refused")])
def test_a_closed_line_is_told_at_once(house: Hub, operator: PageLine, clock: SetClock, end: Close | None, cause: str):
    operator.end = end
    house.close(operator)
    rounds(house, clock, 0.15)
    assert shown_cause(house) == cause
    assert shown(house, Role.PARTICIPANT)["picture"][-1]["notice"] == cause
    # A page that steers again ends the notice.
    page(house, Role.OPERATOR, clock)
    rounds(house, clock, 0.15)
    assert shown(house, Role.PARTICIPANT)["picture"][-1]["notice"] is None


def test_a_gap_with_another_cause_is_no_message(house: Hub, operator: PageLine, clock: SetClock):
    run(hear(house, operator, json.dumps(beat(cause="sabotage", seconds=1.0))))
    assert operator.end is Close.POLICY


def test_without_a_protocol_the_participant_is_told_too(hub: Hub):
    participant = page(hub, Role.PARTICIPANT)
    operator = page(hub, Role.OPERATOR)
    hub.close(operator)
    run(Broadcaster(hub).step())
    (text,) = participant.outbox._news["picture"]
    told = {"kind": "picture", "picture": None, "screen": None, "notice": "closed", "rest": None}
    assert json.loads(text) == told


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("cause", get_args(Cause))
def test_each_cause_has_simple_words_for_the_participant(language: str, cause: str):
    text = LANGUAGES[language][f"participant.lost.{cause}"]
    assert len(text.split()) <= 9
    assert "{" not in text


def test_the_end_of_the_session_is_the_last_word_to_every_page(house: Hub, operator: PageLine, clock: SetClock):
    house.farewell()
    for line in house.lines.values():
        last = json.loads(line.outbox._words[-1])
        assert (last["kind"], last["why"]["code"], last["failed"]) == ("ended", "console.ended", False)
    house.failure = RuntimeError("a mistake")
    house.farewell()
    assert json.loads(operator.outbox._words[-1])["why"]["code"] == "console.failed"
