"""Messages of pages reach desk and run once, in time, and under the role of their page (F30–F33)."""

import asyncio
import json

from exograv.console.handlers import hear
from exograv.console.hub import ACTS_WAITING_MAX, Hub
from exograv.console.keys import Role, TokenUse
from exograv.safety.modes import Mode

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import answer, do, name, page, run, told


def floating(house: Hub, desk: FakeDesk, clock: SetClock):
    """Line of an operator who has taken the arm."""
    line = page(house, Role.OPERATOR, clock)
    for kind in ("make_ready", "take_arm"):
        clock.t += 0.5
        told(house, line, {"kind": "beat"})
        assert answer(told(house, line, do(clock, kind, desk.shown().version)))["taken"]
    clock.t += 0.5
    told(house, line, {"kind": "beat"})
    assert desk.shown().mode == "floating"
    return line


def test_an_arm_is_taken_in_two_steps_by_whoever_saw_what_is_there(house: Hub, desk: FakeDesk, clock: SetClock):
    line = page(house, Role.OPERATOR, clock)
    assert not answer(told(house, line, do(clock, "take_arm", desk.shown().version)))["taken"]
    seen = desk.shown().version
    assert answer(told(house, line, do(clock, "make_ready", seen)))["taken"]
    clock.t += 0.1
    assert "changed" in answer(told(house, line, do(clock, "take_arm", seen)))["why"]
    assert answer(told(house, line, do(clock, "take_arm", desk.shown().version)))["taken"]


def test_an_act_that_is_sent_twice_is_done_once_and_answered_twice_alike(house: Hub, desk: FakeDesk, clock: SetClock):
    line = page(house, Role.OPERATOR, clock)
    act = do(clock, "make_ready", desk.shown().version)
    first, second = answer(told(house, line, act)), answer(told(house, line, act))
    assert first == second
    assert len(desk.taken) == 1


def test_an_act_that_is_late_by_the_pages_own_clock_is_refused_and_a_late_stop_is_not(
    house: Hub, desk: FakeDesk, clock: SetClock
):
    line = page(house, Role.OPERATOR, clock)
    assert not answer(told(house, line, do(clock, "make_ready", desk.shown().version, age_s=0.7)))["taken"]
    assert answer(told(house, line, do(clock, "make_ready", desk.shown().version, age_s=0.3)))["taken"]
    assert answer(told(house, line, do(clock, "stop", age_s=30.0)))["taken"]


def test_a_page_cannot_make_an_act_younger_by_a_clock_that_runs_ahead(house: Hub, desk: FakeDesk, clock: SetClock):
    line = page(house, Role.OPERATOR, clock)
    assert answer(told(house, line, do(clock, "make_ready", desk.shown().version, age_s=-50.0)))["taken"]
    assert desk.asked[-1][0].made_at_s <= clock.t


def test_nothing_but_stop_is_taken_before_the_pages_clock_is_known(house: Hub, desk: FakeDesk, clock: SetClock):
    line = page(house, Role.OPERATOR)
    assert "clock" in answer(told(house, line, do(clock, "make_ready", 1)))["why"]
    assert answer(told(house, line, do(clock, "stop")))["taken"]


def test_a_stop_waits_for_no_other_act(house: Hub, desk: FakeDesk, clock: SetClock):
    line = floating(house, desk, clock)
    taken = list[str]()

    async def both() -> None:
        await house._turn.acquire()
        slow = asyncio.create_task(hear(house, line, json.dumps(do(clock, "give_back"))))
        await asyncio.sleep(0)
        await hear(house, line, json.dumps(do(clock, "stop")))
        taken.extend(act.kind for act in desk.taken[-1:])
        house._turn.release()
        await slow

    run(both())
    assert taken == ["stop"]
    assert desk.machine.mode is Mode.SAFE


def test_who_presses_on_without_waiting_is_refused(house: Hub, desk: FakeDesk, clock: SetClock):
    line = floating(house, desk, clock)

    async def many() -> None:
        await house._turn.acquire()
        words = [json.dumps(do(clock, "note", text="again")) for _ in range(2 * ACTS_WAITING_MAX)]
        tasks = [asyncio.create_task(hear(house, line, word)) for word in words]
        await asyncio.sleep(0)
        house._turn.release()
        await asyncio.gather(*tasks)

    run(many())
    assert sum(act.kind == "note" for act in desk.taken) == ACTS_WAITING_MAX


def test_a_lease_that_is_lost_while_an_act_waits_is_lost_for_it_too(house: Hub, desk: FakeDesk, clock: SetClock):
    line = floating(house, desk, clock)

    async def wait() -> None:
        await house._turn.acquire()
        task = asyncio.create_task(hear(house, line, json.dumps(do(clock, "give_back"))))
        await asyncio.sleep(0)
        clock.t += 1.3
        house._turn.release()
        await task

    run(wait())
    assert all(act.kind != "give_back" for act in desk.taken)


def test_the_desk_is_told_that_somebody_steers_for_each_beat_of_the_holder_and_of_no_other(
    house: Hub, desk: FakeDesk, clock: SetClock
):
    first, second = page(house, Role.OPERATOR, clock), page(house, Role.OPERATOR, clock)
    told(house, first, {"kind": "beat"})
    told(house, second, {"kind": "beat"})
    assert desk.kept == [None]
    clock.t += 1.3
    told(house, first, {"kind": "beat"})
    assert desk.kept == [None]


def test_the_second_operator_may_steer_when_the_first_is_gone(house: Hub, clock: SetClock):
    first, second = page(house, Role.OPERATOR, clock), page(house, Role.OPERATOR, clock)
    assert not answer(told(house, second, {"kind": "steer", "id": name()}))["taken"]
    house.close(first)
    assert answer(told(house, second, {"kind": "steer", "id": name()}))["taken"]


def test_an_operator_who_goes_while_an_arm_is_carried_is_an_alarm(house: Hub, desk: FakeDesk, clock: SetClock):
    line = floating(house, desk, clock)
    house.close(line)
    assert [alarm.priority for alarm in house.alarms.open] == ["high"]


def test_a_link_that_the_operator_makes_lets_one_person_in(house: Hub, clock: SetClock):
    line = page(house, Role.OPERATOR, clock)
    link = answer(told(house, line, {"kind": "invite", "id": name(), "role": "participant"}))["link"]
    origin, _, token = link.partition("/#")
    assert origin == house.origin
    entered = house.keys.enter(token, "192.168.1.9")
    assert not isinstance(entered, TokenUse)
    assert entered[0] is Role.PARTICIPANT


def test_no_link_and_no_secret_is_in_the_diary(house: Hub, clock: SetClock):
    line = page(house, Role.OPERATOR, clock)
    link = answer(told(house, line, {"kind": "invite", "id": name(), "role": "viewer"}))["link"]
    text = house.diary.path.read_text(encoding="utf-8")
    assert "link made" in text
    assert link.partition("#")[2] not in text


def test_while_a_protocol_sets_the_level_nobody_else_does(house: Hub, desk: FakeDesk, clock: SetClock):
    line = floating(house, desk, clock)
    assert answer(told(house, line, do(clock, "set_level", gravity_level=0.5)))["taken"]
    assert answer(told(house, line, {"kind": "run", "id": name(), "made": clock.t - 100.0, "word": "start"}))["taken"]
    assert "protocol" in answer(told(house, line, do(clock, "set_level", gravity_level=0.2)))["why"]


def test_an_alarm_of_the_console_is_seen_once(house: Hub, clock: SetClock):
    line = page(house, Role.OPERATOR, clock)
    number = house.alarms.sound("A page is slow.", clock.t).number
    seen = {"kind": "seen", "of": "console", "alarm": number}
    assert answer(told(house, line, {**seen, "id": name()}))["taken"]
    assert not answer(told(house, line, {**seen, "id": name()}))["taken"]
