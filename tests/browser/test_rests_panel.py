"""The operator sees in both languages what the rests have taught, and asks for the next one by one button."""

import json

import pytest
from tests.console.serving import Served
from tests.waiting import wait_until

from exograv.console.keys import Role
from exograv.console.page_files import PAGES
from exograv.experiment.steered.sentences import say
from exograv.experiment.steered.view_models import RestLearning, WorkProgress

from .conftest import Visit
from .of_browser import take_arm

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
