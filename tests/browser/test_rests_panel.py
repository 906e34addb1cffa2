"""Both languages: the operator sees what the rests have taught, and the participant when the machine moves the arm."""

import json
from typing import Literal

import pytest
from tests.console.serving import Served
from tests.waiting import wait_until

from exograv.console.keys import Role
from exograv.console.page_files import PAGES
from exograv.experiment.steered.sentences import say
from exograv.experiment.steered.view_models import RestLearning, WorkProgress

from .conftest import Visit
from .of_browser import MISFITS, TOUCH_MIN_PX, take_arm

pytestmark = pytest.mark.slow

LEARNED = RestLearning(
    is_active=False,
    rests=2,
    motion_s=19.4,
    before_Nm=(0.30, 0.15, 0.16, 0.24),
    stated_Nm=(0.15, 0.09, 0.07, 0.12),
    target_Nm=(0.2, 0.2, 0.2, 0.1),
    sentences=(
        say("rest.taken"),
        say("rest.shown", joint="elbow_flexion", before="0.24", after="0.12"),
        say("rest.missing", joint="elbow_flexion", target="0.1"),
    ),
)
WORDS = {
    "en": ("Learn in this rest", "2 rests, 19 s of motion", "0.24 → 0.12 / 0.10", "The model of the arm was"),
    "de": ("In dieser Pause lernen", "2 Pausen, 19 s Bewegung", "0,24 → 0,12 / 0,10", "Das Modell des Arms wurde"),
}
PAGE_WORDS = {name: json.loads((PAGES / "words" / f"{name}.json").read_text(encoding="utf-8")) for name in WORDS}


@pytest.mark.parametrize("language", WORDS)
def test_the_operator_sees_what_the_rests_have_taught_and_asks_for_the_next_one(
    visit: Visit, house: Served, language: str
):
    house.desk.rests = LEARNED
    operator = visit(Role.OPERATOR, language)
    take_arm(operator)
    panel = operator.page.locator("#rests")
    for text in WORDS[language]:
        panel.filter(has_text=text).wait_for()
    assert "elbow_flexion" not in panel.inner_text()
    operator.press("[data-act=learn_rest]")
    wait_until(lambda: house.desk.asked[-1][0].kind == "learn_rest", "the request")
    house.desk.rests = LEARNED.model_copy(update={"is_active": True, "why_not": say("rest.runs")})
    house.desk.work = WorkProgress(
        kind="rest", phase=say("rest.phase_moves"), joint="elbow_flexion", share_done=0.4, left_s=12.0,
        why=say("work.rest"),
    )  # fmt: skip
    operator.page.locator("#work").wait_for()
    assert operator.page.locator("#work-title").inner_text() == PAGE_WORDS[language]["work.rest"]


STAGES: tuple[Literal["soon", "moves", "holds"], ...] = ("soon", "moves", "holds")
HEADLINE_SHARE = 0.05
"""Smallest height of a letter of the announcement as a share of the screen's height [-]: as the page's other headlines
it is read from the machine's seat."""


@pytest.mark.parametrize("language", WORDS)
@pytest.mark.parametrize("width", [1280, 600])
def test_the_participant_reads_each_stage_of_a_motion_in_large_type_and_the_page_holds_it(
    visit: Visit, house: Served, language: str, width: int
):
    operator, participant = visit(Role.OPERATOR), visit(Role.PARTICIPANT, language, width=width)
    take_arm(operator)
    words, headline = PAGE_WORDS[language], participant.page.locator("#headline")

    def reads(stage: str) -> None:
        headline.filter(has_text=words[f"participant.learn_{stage}"].format(seconds=10)).wait_for()
        participant.page.locator("#more", has_text=words[f"participant.learn_{stage}.more"]).wait_for()

    for stage in STAGES:
        house.desk.rests = RestLearning(is_active=True, stage=stage, moves_s=10.0)
        reads(stage)
        size = headline.evaluate("element => parseFloat(getComputedStyle(element).fontSize)")
        assert size >= HEADLINE_SHARE * 800
        assert participant.page.evaluate(MISFITS, TOUCH_MIN_PX) == []
        box, stop = participant.page.locator("#more").bounding_box(), participant.page.locator("#stop").bounding_box()
        assert box is not None
        assert stop is not None
        assert box["y"] + box["height"] <= stop["y"], "no word lies under Stop"
    house.desk.rests = RestLearning(is_active=False, moves_s=10.0)
    reads("over")
