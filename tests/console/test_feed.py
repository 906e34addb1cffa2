"""An aircraft's g opens and closes windows; without its data the clock closes a window, and the operator may."""

import multiprocessing
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.experiment.test_aircraft import line as datagram
from tests.task.of_run import short_plan
from tests.waiting import wait_until

from exograv.console.broadcaster import Broadcaster
from exograv.console.feed import Feed, receiver_of
from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.sentences import say
from exograv.errors import ConfigError
from exograv.experiment.aircraft import AircraftReceiver, Destination, Emulation, emulate
from exograv.task.events import Start, Tick
from exograv.task.flight_profile import FlightProfile, Network
from exograv.task.plan import TaskPlan
from exograv.task.record_sinks import AIRCRAFT_TOPIC

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import answer, do, page, told
from .serving import hub_on, served
from .test_trial import trial_of, word

FLIGHT = FlightProfile(parabolas=2, before_s=0.5, ramp_s=0.3, hyper_s=0.5, window_s=2.0, after_s=0.5)
SILENT_S = 0.4


def flight_plan() -> TaskPlan:
    """Plan with two windows of two seconds and a short time-out of the feed."""
    plan = short_plan("flight", screen=None, windows=2)
    settings = plan.loaded.settings
    windows = settings.windows.model_copy(update={"duration_s": 2.0})
    aircraft = settings.aircraft.model_copy(update={"silent_s": SILENT_S})
    settings = settings.model_copy(update={"windows": windows, "aircraft": aircraft})
    return TaskPlan(type(plan.loaded)(settings, plan.loaded.path, plan.loaded.sha256), plan.exo)


@pytest.fixture
def flown(desk: FakeDesk, tmp_path: Path) -> Iterator[tuple[Hub, AircraftReceiver]]:
    plan = flight_plan()
    with hub_on(desk, tmp_path, plan) as hub, receiver_of(plan, 0, None) as receiver:
        hub.feed = Feed(receiver, trial_of(hub), hub.diary)
        yield hub, receiver


def test_nothing_heard_when_the_run_begins_is_an_alarm_once(flown: tuple[Hub, AircraftReceiver], clock: SetClock):
    hub, _ = flown
    operator = page(hub, Role.OPERATOR, clock)
    news = Broadcaster(hub)
    news._run_trial(clock.t, trial_of(hub))
    assert hub.alarms.open == ()
    assert answer(told(hub, operator, word(clock, "start")))["taken"]
    for _ in range(3):
        news._run_trial(clock.t, trial_of(hub))
    assert [(alarm.text, alarm.times) for alarm in hub.alarms.open] == [(say("aircraft.not_heard"), 1)]


def test_g_opens_a_window_and_one_that_is_not_closed_any_more_ends_by_the_clock(
    flown: tuple[Hub, AircraftReceiver], desk: FakeDesk, clock: SetClock
):
    hub, receiver = flown
    begun = clock.t
    operator = page(hub, Role.OPERATOR, clock)
    fly(hub, receiver, [1.0], begun)
    assert answer(told(hub, operator, word(clock, "start")))["taken"]
    fly(hub, receiver, [0.02] * 12, begun + 0.1)
    assert [(each.number, each.is_open) for each in windows(hub, begun + 1.3)] == [(1, True)]
    said = shown(hub, begun + 1.2)
    assert said["sample"] == {"g": 0.02, "parabola": 3, "announcement": "UNKNOWN"}
    assert (said["is_window"], said["is_lost"], round(said["age_s"], 3)) == (True, False, 0.0)
    samples = [message for topic, _, message in desk.written if topic == AIRCRAFT_TOPIC]
    assert len(samples) == 13
    assert samples[-1] == {"g": [0.0, 0.0, 0.02], "parabola": 3, "announcement": "UNKNOWN"}
    # Lost data raise an alarm, and the window continues to its nominal end.
    step(hub, begun + 1.2 + SILENT_S + 0.1)
    assert "data have stopped: window 1 ends by the clock" in trial_of(hub).operator(begun + 1.7).alarms[0].text
    assert windows(hub, begun + 1.7)[0].is_open
    assert shown(hub, begun + 1.7)["is_lost"]
    step(hub, begun + 4.0)
    (window,) = windows(hub, begun + 4.0)
    assert (window.is_open, window.is_complete, window.marks) == (False, True, ("feed lost",))


def test_a_hand_opens_and_closes_where_nothing_comes(flown: tuple[Hub, AircraftReceiver], clock: SetClock):
    hub, _ = flown
    operator = page(hub, Role.OPERATOR, clock)
    for what in ("start", "open", "close"):
        clock.t += 0.9
        told(hub, operator, {"kind": "beat"})
        assert answer(told(hub, operator, word(clock, what)))["taken"]
    assert [each.is_open for each in windows(hub, clock.t)] == [False]


@pytest.mark.parametrize("act", ["make_ready", "take_arm", "identify"])
def test_in_flight_no_motor_is_switched_on(
    flown: tuple[Hub, AircraftReceiver], desk: FakeDesk, clock: SetClock, act: str
):
    hub, _ = flown
    operator = page(hub, Role.OPERATOR, clock)
    assert "only records" in answer(told(hub, operator, do(clock, act, desk.shown().version)))["why"]
    assert desk.asked == []


def test_an_aircraft_that_nobody_flies_is_refused():
    with pytest.raises(ConfigError, match="opening = 'aircraft'"):
        receiver_of(short_plan(), 0, None)
    with pytest.raises(ConfigError, match="70000"):
        receiver_of(flight_plan(), 70_000, None)


@pytest.mark.slow
def test_an_emulated_flight_of_another_process_opens_windows_until_it_ends_in_one(tmp_path: Path):
    plan = flight_plan()
    with served(tmp_path, plan) as house, receiver_of(plan, 0, None) as receiver:
        trial = trial_of(house.hub)
        emulation = Emulation(FLIGHT, Network(loss=0.02, jitter_s=0.005), Destination(port=receiver.port))
        aircraft = multiprocessing.get_context("spawn").Process(target=emulate, args=(emulation, print), daemon=True)
        aircraft.start()
        house.loop.call_soon_threadsafe(setattr, house.hub, "feed", Feed(receiver, trial, house.hub.diary))
        wait_until(lambda: receiver.heard > 0, seconds=20.0)
        house.loop.call_soon_threadsafe(trial.run.feed, Start(t=house.desk.now()))
        wait_until(lambda: [each.is_complete for each in trial.run.state.windows] == [True, False], seconds=20.0)
        aircraft.kill()
        wait_until(lambda: len(trial.run.state.complete) == 2, seconds=20.0)
        first, second = trial.run.state.windows
        assert ("feed lost" in first.marks, "feed lost" in second.marks) == (False, True)
        assert trial.run.state.is_feed_lost
        aircraft.join()


def fly(hub: Hub, receiver: AircraftReceiver, levels: list[float], begun: float) -> None:
    """Send ten samples per second."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for k, level in enumerate(levels):
            sender.sendto(datagram(level, round(10 * begun) + k), ("127.0.0.1", receiver.port))
            step(hub, begun + 0.1 * k)


def step(hub: Hub, t: float) -> None:
    assert hub.feed is not None
    hub.feed.step(t)
    trial_of(hub).run.feed(Tick(t=t))


def shown(hub: Hub, t: float) -> dict[str, Any]:
    assert hub.feed is not None
    return hub.feed.shown(t)


def windows(hub: Hub, t: float):
    return trial_of(hub).operator(t).windows
