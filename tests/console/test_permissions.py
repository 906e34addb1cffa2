"""Each role may send the words of its row in the table, and no others; Stop is accepted from every role (F36)."""

from typing import get_args

import pytest

from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.permissions import ACTS, MAY, WITHOUT_LEASE, WORDS
from exograv.experiment.steered.view_models import ActKind

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import answer, do, name, page, told, touch

VERSIONED = ("don", "make_ready", "take_arm", "identify", "reset", "learn_rest")
FIELDS = {"set_level": {"gravity_level": 0.5}, "note": {"text": "calm"}, "acknowledge": {"alarm": 1}}
# The table is written a second time by hand, so that an error in the first one shows.
EXPECTED = {
    "operator": {
        "ping", "beat", "steer", "seen", "invite", "run", "do don", "do make_ready", "do take_arm", "do identify",
        "do give_back", "do stop", "do reset", "do switch_off", "do set_level", "do learn_rest", "do note",
        "do acknowledge",
    },
    "therapist": {
        "ping", "beat", "steer", "do don", "do make_ready", "do take_arm", "do give_back", "do stop", "do reset",
        "do switch_off", "do set_level",
    },
    "participant": {"ping", "do stop", "do agree", "touches", "trail", "calibrate", "latency"},
    "viewer": {"ping", "do stop"},
}  # fmt: skip


def said(word: str, clock: SetClock, line_page: str) -> dict[str, object]:
    """Valid message of each word."""
    if word.startswith("do "):
        act = word.removeprefix("do ")
        return do(clock, act, 1 if act in VERSIONED else None, **FIELDS.get(act, {}))
    return {
        "ping": {"kind": "ping", "asked": 1.0},
        "beat": {"kind": "beat"},
        "steer": {"kind": "steer", "id": name()},
        "seen": {"kind": "seen", "id": name(), "of": "console", "alarm": 1},
        "invite": {"kind": "invite", "id": name(), "role": "viewer"},
        "run": {"kind": "run", "id": name(), "made": clock.t - 100.0, "word": "start"},
        "touches": {"kind": "touches", "touches": [touch(clock, 0, line_page)]},
        "trail": {"kind": "trail", "page": line_page, "sequence": 0, "ended": "up", "points": [[1.0, 2.0, 3.0]]},
        "calibrate": {"kind": "calibrate", "id": name(), "card_px": [400.0, 252.2]},
        "latency": {"kind": "latency", "id": name(), "method": "flash", "delays_ms": [50.0, 60.0, 70.0]},
    }[word]


def test_the_table_is_as_it_was_agreed():
    assert {role.value: set(words) for role, words in MAY.items()} == EXPECTED
    assert set().union(*MAY.values()) == set(WORDS)
    assert {f"do {act}" for act in ACTS} == {word for word in WORDS if word.startswith("do ")}


def test_every_act_of_the_session_stands_in_the_table():
    assert set(get_args(ActKind)) == set(ACTS)


@pytest.mark.parametrize("word", WORDS)
@pytest.mark.parametrize("role", Role)
def test_what_a_role_may_not_say_reaches_nobody_and_is_an_alarm(
    house: Hub, desk: FakeDesk, clock: SetClock, role: Role, word: str
):
    line = page(house, role, clock)
    version = desk.shown().version
    words = told(house, line, said(word, clock, line.page))
    assert line.end is None
    refusals = [alarm.text for alarm in house.alarms.open if "and was refused" in alarm.text]
    if word in EXPECTED[role.value]:
        assert refusals == []
        return
    assert refusals == [f"A {role.value} page asked for '{word}', and was refused."]
    assert desk.asked == []
    assert desk.shown().version == version
    assert [word for word in words if word["kind"] == "answer" and word["answer"]["taken"]] == []
    assert not any(topic == "/task" for topic, _, _ in desk.written)


@pytest.mark.parametrize("word", sorted(set(WORDS) - WITHOUT_LEASE))
def test_what_steers_is_taken_from_the_page_that_holds_the_lease_only(
    house: Hub, desk: FakeDesk, clock: SetClock, word: str
):
    first, second = page(house, Role.OPERATOR, clock), page(house, Role.OPERATOR, clock)
    assert house.steers(first)
    assert not answer(told(house, second, said(word, clock, second.page)))["taken"]
    assert desk.asked == []
    # An expired lease is lost for its former holder too.
    clock.t += 1.3
    assert not answer(told(house, first, said(word, clock, first.page)))["taken"]
    assert desk.asked == []


@pytest.mark.parametrize("role", Role)
def test_stop_is_heard_from_every_page_whoever_steers(house: Hub, desk: FakeDesk, clock: SetClock, role: Role):
    page(house, Role.OPERATOR, clock)
    line = page(house, role, clock)
    assert answer(told(house, line, do(clock, "stop")))["taken"]
    assert [(act.kind, by) for act, by in desk.asked] == [("stop", role.value)]
