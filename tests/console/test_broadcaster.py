"""The broadcaster sends news to pages and levels to the machine, and a programming error ends the console."""

import asyncio
import itertools
import json
from pathlib import Path

import pytest

from exograv.console.broadcaster import Broadcaster
from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.errors import ConfigError

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import do, page, run, told
from .serving import served
from .test_handlers import floating
from .test_trial import word

STEP_S = 0.015


def rounds(house: Hub, clock: SetClock, seconds: float, news: Broadcaster | None = None) -> Broadcaster:
    """Run rounds of the broadcaster while the clock advances."""
    news = news or Broadcaster(house)

    async def go() -> None:
        for _ in range(round(seconds / STEP_S)):
            clock.t += STEP_S
            await news.step()
            # The clock stands still while the desk answers, so that a busy computer does not change the result.
            while not news._asking.is_over():
                await asyncio.sleep(0.0005)
        while not (news._looking.is_over() and news._drawing.is_over() and news._asking.is_over()):
            await asyncio.sleep(0.001)

    run(go())
    return news


def shown(house: Hub, role: Role) -> dict[str, list[dict]]:
    """Waiting news of a page by kind."""
    (line,) = [line for line in house.lines.values() if line.role is role]
    return {kind: [json.loads(text) for text in waiting] for kind, waiting in line.outbox._news.items()}


def test_the_participant_sees_nothing_of_arm_machine_or_person(house: Hub, desk: FakeDesk, clock: SetClock):
    floating(house, desk, clock)
    page(house, Role.PARTICIPANT, clock)
    rounds(house, clock, 0.5)
    assert set(shown(house, Role.PARTICIPANT)) == {"picture"}
    text = json.dumps(shown(house, Role.PARTICIPANT))
    for hidden in ("T01", "q_rad", "gravity", "tau", "deviation", "shoulder"):
        assert hidden not in text


def test_the_therapist_sees_the_state_and_no_plots(house: Hub, clock: SetClock):
    page(house, Role.THERAPIST, clock)
    rounds(house, clock, 0.3)
    assert set(shown(house, Role.THERAPIST)) == {"state"}


def test_the_level_of_the_protocol_is_asked_for_in_small_steps_and_reached(house: Hub, desk: FakeDesk, clock: SetClock):
    operator = floating(house, desk, clock)
    told(house, operator, word(clock, "start"))
    news = rounds(house, clock, 26.0)
    asked = [act.gravity_level for act in desk.taken if act.kind == "set_level"]
    assert all(level == 1.0 for level in asked)
    rounds(house, clock, 9.5, news)
    asked = [act.gravity_level for act in desk.taken if act.kind == "set_level"]
    assert asked[-1] == 0.0
    assert sorted(asked, reverse=True) == asked
    assert max(a - b for a, b in itertools.pairwise(asked)) < 0.05


def test_no_level_is_asked_for_where_none_can_be_set(house: Hub, desk: FakeDesk, clock: SetClock):
    operator = floating(house, desk, clock)
    told(house, operator, word(clock, "start"))
    rounds(house, clock, 1.0)
    told(house, operator, do(clock, "stop"))
    before = len(desk.asked)
    rounds(house, clock, 1.0)
    assert house.trial is not None
    assert house.trial.run.state.status == "paused"
    assert len(desk.asked) == before


def test_a_page_that_falls_silent_is_one_alarm_while_an_arm_is_carried(house: Hub, desk: FakeDesk, clock: SetClock):
    floating(house, desk, clock)
    rounds(house, clock, 3.0)
    assert [(alarm.priority, alarm.times) for alarm in house.alarms.open] == [("high", 1)]
    assert house.lease.holder is None


def test_a_desk_that_fails_ends_the_server_and_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    desk = FakeDesk()
    with served(tmp_path, None, desk) as house:
        house.hub.on_failure = lambda: setattr(house.server, "should_exit", True)

        def fail():
            raise ConfigError("The desk is broken.")

        monkeypatch.setattr(desk, "shown", fail)
        page_count = len(house.hub.lines)
        for _ in range(200):
            if house.server.should_exit:
                break
            asyncio.run(asyncio.sleep(0.01))
        assert house.server.should_exit
        assert page_count == 0
    assert isinstance(house.hub.failure, ConfigError)
