"""Operator, viewer and therapist read the same support for the same state: one name, one direction, both languages."""

import json
import re

import pytest
from tests.console.serving import Served
from tests.waiting import wait_until

from exograv.console.keys import Role
from exograv.console.page_files import PAGES
from exograv.safety.modes import Event, Mode
from exograv.sentence import SUPPORT_TEXT, support_text

from .conftest import Visit
from .of_browser import Visitor

LANGUAGES = ("en", "de")
WORDS = {name: json.loads((PAGES / "words" / f"{name}.json").read_text(encoding="utf-8")) for name in LANGUAGES}


def shown(visitor: Visitor, language: str, name: str) -> tuple[int, int]:
    """Read support and felt weight [%] from a page, by the words of its language."""
    # A page that has just opened is empty until its first message.
    filled = visitor.page.locator(f"#support-{name}", has_text="%")
    filled.wait_for()
    text = filled.inner_text().replace("\xa0", " ")
    wording = re.escape(WORDS[language][f"support.{name}"].replace("{value}", WORDS[language]["support.value"]))
    found = re.fullmatch(wording.replace(r"\{support\}", r"(\d+)").replace(r"\{felt\}", r"(\d+)"), text)
    assert found is not None, (text, wording)
    return int(found[1]), int(found[2])


@pytest.mark.parametrize("language", ["en", pytest.param("de", marks=pytest.mark.long)])
def test_all_pages_show_the_same_support_and_felt_weight_for_the_same_state(house: Served, visit: Visit, language: str):
    pages = [visit(role, language) for role in (Role.OPERATOR, Role.VIEWER, Role.THERAPIST)]
    desk = house.desk
    # With the machine off, no page may claim a support.
    for page in pages:
        wait_until(lambda page=page: shown(page, language, "now") == (0, 100))
        assert page.page.get_by_role("heading", name=WORDS[language]["support.title"]).count() == 1
    for event in (Event.TEST, Event.PASSED, Event.TAKE_ARM):
        desk.machine.take(event)
    desk.level_asked = 0.2
    wait_until(lambda: desk.shown().mode == Mode.FLOATING.name.lower() and desk.level == pytest.approx(0.2))
    for page in pages:
        wait_until(lambda page=page: shown(page, language, "now") == (80, 20))
        assert shown(page, language, "asked") == (80, 20)
    knobs = [page.page.locator("#knob, #support").first.input_value() for page in pages]
    assert knobs == ["80", "80", "80"]


def test_recordings_say_it_in_the_words_of_the_pages():
    assert WORDS["en"]["support.value"] == SUPPORT_TEXT
    assert support_text(0.2) == "support 80 % (felt weight 20 %)"
    assert support_text(0.165) == "support 84 % (felt weight 16 %)"


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_page_names_the_quantity_by_another_word(language: str):
    others = {"en": r"gravity level|gravity changes|lightness", "de": r"\bSchwere\b"}[language]
    assert {name: text for name, text in WORDS[language].items() if re.search(others, text)} == {}


def test_the_large_figure_of_the_therapist_is_the_support_in_force_and_not_the_request(house: Served, visit: Visit):
    page = visit(Role.THERAPIST).page
    house.desk.level_asked = house.desk.level = 0.0  # full support is requested while the machine is off
    page.locator("#support-asked", has_text="Requested: support 100\xa0% (felt weight 0\xa0%)").wait_for()
    assert page.locator("#support-percent").inner_text() == "0\xa0%"
    size = "(id) => parseFloat(getComputedStyle(document.getElementById(id)).fontSize)"
    assert page.evaluate(size, "support-percent") > 3 * page.evaluate(size, "support-asked")
