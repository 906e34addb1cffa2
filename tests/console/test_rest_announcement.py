"""The participant reads before, during and after a motion in a rest what the machine does with the arm."""

import json
from typing import Literal

import pytest

from exograv.console.broadcaster import Broadcaster
from exograv.console.hub import Hub
from exograv.console.keys import Role
from exograv.console.page_files import PAGES
from exograv.console.rest_announcement import OVER_S
from exograv.experiment.steered.rest_stages import STAGES
from exograv.experiment.steered.view_models import RestLearning
from exograv.procedures.identification.rest_text import RestPhase
from exograv.safety.modes import Event

from .fake_desk import FakeDesk
from .of_clock import SetClock
from .said import page
from .test_broadcaster import rounds, shown
from .test_handlers import floating

Stage = Literal["soon", "moves", "holds"]
IN_ORDER: tuple[Stage, ...] = ("soon", "moves", "holds")


def in_rest(stage: Stage) -> RestLearning:
    return RestLearning(is_active=True, stage=stage, moves_s=10.0)


def announced(house: Hub, clock: SetClock, news: Broadcaster) -> dict[str, object] | None:
    """Return the announcement after the broadcaster has read the present state of the desk."""
    for _ in range(2):
        rounds(house, clock, 0.3, news)
    return shown(house, Role.PARTICIPANT)["picture"][-1]["rest"]


def test_each_stage_is_announced_and_its_end_for_some_seconds(house: Hub, desk: FakeDesk, clock: SetClock):
    floating(house, desk, clock)
    page(house, Role.PARTICIPANT, clock)
    news = Broadcaster(house)
    assert announced(house, clock, news) is None
    for stage in IN_ORDER:
        desk.rests = in_rest(stage)
        assert announced(house, clock, news) == {"stage": stage, "seconds": 10}
    desk.rests = RestLearning(is_active=False, moves_s=10.0)
    assert announced(house, clock, news) == {"stage": "over", "seconds": 10}
    rounds(house, clock, OVER_S, news)
    assert announced(house, clock, news) is None


def test_a_motion_that_stop_has_ended_is_not_said_to_be_over(house: Hub, desk: FakeDesk, clock: SetClock):
    floating(house, desk, clock)
    page(house, Role.PARTICIPANT, clock)
    desk.rests = in_rest("moves")
    news = Broadcaster(house)
    assert announced(house, clock, news) is not None
    desk.machine.take(Event.FAULT)
    desk.rests = RestLearning(is_active=False, moves_s=10.0)
    assert announced(house, clock, news) is None


@pytest.mark.parametrize("language", ["en", "de"])
def test_every_stage_of_every_phase_has_words_for_the_participant(language: str):
    words = json.loads((PAGES / "words" / f"{language}.json").read_text(encoding="utf-8"))
    for stage in {*(STAGES[phase] for phase in RestPhase), "over"}:
        assert {f"participant.learn_{stage}", f"participant.learn_{stage}.more"} <= words.keys()
    for stage in ("soon", "moves"):
        assert "{seconds}" in words[f"participant.learn_{stage}"]
