"""A protocol pushes the arm down only after the participant has agreed on the own page."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from exograv.console.hub import Hub, PageLine
from exograv.console.keys import Role
from exograv.task.plan import TaskPlan
from exograv.task.protocol import FOLDER, load_protocol

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import answer, do, name, page, told
from .serving import hub_on
from .test_handlers import floating

PULL_UP_S = 30.0
"""Time from the start of the protocol to the first pull-up [s]."""


@pytest.fixture
def parabola(desk: FakeDesk, tmp_path: Path) -> Iterator[Hub]:
    """Console with the protocol that flies parabolas on the ground."""
    with hub_on(desk, tmp_path, TaskPlan(load_protocol("parabola"), "active")) as hub:
        yield hub


def started(house: Hub, desk: FakeDesk, clock: SetClock) -> tuple[PageLine, PageLine]:
    """Start the protocol; return the lines of operator and participant."""
    operator = floating(house, desk, clock)
    start = {"kind": "run", "id": name(), "made": clock.t - 100.0, "word": "start"}
    assert answer(told(house, operator, start))["taken"]
    return operator, page(house, Role.PARTICIPANT, clock)


def at(house: Hub, desk: FakeDesk, clock: SetClock, seconds: float) -> str:
    """Advance by this time; return the alarm of a run that was paused."""
    assert house.trial is not None
    clock.t += seconds
    return house.trial.tick(clock.t, desk.shown())


def asks(house: Hub, clock: SetClock) -> bool:
    assert house.trial is not None
    return house.trial.participant(clock.t).asks_consent


def test_the_page_asks_before_a_pull_up_until_the_participant_has_agreed(parabola, desk, clock):
    operator, participant = started(parabola, desk, clock)
    at(parabola, desk, clock, PULL_UP_S - 10.0)
    assert asks(parabola, clock)
    told(parabola, operator, {"kind": "beat"})
    assert answer(told(parabola, participant, do(clock, "agree")))["taken"]
    assert not asks(parabola, clock)
    assert not at(parabola, desk, clock, 12.0)
    assert parabola.trial.is_running
    assert parabola.trial.level(clock.t) > 1.0


def test_a_pull_up_without_consent_pauses_the_run_before_the_level_rises(parabola, desk, clock):
    started(parabola, desk, clock)
    assert not at(parabola, desk, clock, PULL_UP_S - 0.1)
    assert "has not agreed" in at(parabola, desk, clock, 0.2)
    assert not parabola.trial.is_running
    assert parabola.trial.level(clock.t) <= 1.0 + 0.2 * 0.2


def test_each_pull_up_needs_a_consent_of_its_own(parabola, desk, clock):
    operator, participant = started(parabola, desk, clock)
    at(parabola, desk, clock, PULL_UP_S - 10.0)
    told(parabola, operator, {"kind": "beat"})
    told(parabola, participant, do(clock, "agree"))
    at(parabola, desk, clock, 10.0 + 82.0 + 80.0)
    assert parabola.trial.is_running
    assert asks(parabola, clock)
    assert "has not agreed" in at(parabola, desk, clock, 20.0)


def test_no_other_page_agrees_for_the_participant(parabola, desk, clock):
    operator, _ = started(parabola, desk, clock)
    at(parabola, desk, clock, PULL_UP_S - 10.0)
    told(parabola, operator, {"kind": "beat"})
    told(parabola, operator, do(clock, "agree"))
    assert not [act for act in desk.taken if act.kind == "agree"]
    assert asks(parabola, clock)


def test_a_protocol_without_pull_ups_never_asks(house, desk, clock):
    started(house, desk, clock)
    for _ in range(120):
        at(house, desk, clock, 1.0)
        assert not asks(house, clock)


def test_a_window_above_earth_without_pull_ups_asks_too(desk, clock, tmp_path):
    text = (FOLDER / "training.toml").read_text(encoding="utf-8").replace('level = "weightless"', 'level = "hyper"')
    protocol = tmp_path / "heavy.toml"
    protocol.write_text(text.replace('"target", ', '"target", "windows.levels", '), encoding="utf-8")
    with hub_on(desk, tmp_path, TaskPlan(load_protocol(str(protocol)), "active")) as house:
        started(house, desk, clock)
        at(house, desk, clock, 15.0)
        assert asks(house, clock)


def test_the_participant_agrees_in_a_pause_so_that_the_run_goes_on_after_it(parabola, desk, clock):
    operator, participant = started(parabola, desk, clock)
    at(parabola, desk, clock, PULL_UP_S - 0.1)
    assert at(parabola, desk, clock, 0.2)
    assert asks(parabola, clock)
    told(parabola, operator, {"kind": "beat"})
    assert answer(told(parabola, participant, do(clock, "agree")))["taken"]
    assert not asks(parabola, clock)
