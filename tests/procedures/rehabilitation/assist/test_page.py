"""Assist page: it shows every decision in its language, the bounds, and that no person took part."""

import re
from collections.abc import Mapping
from pathlib import Path

import pytest

from exograv.console.words import said_in
from exograv.options import OptionRecord
from exograv.procedures.rehabilitation.assist.page import course, page_of, write_assist_page
from exograv.procedures.rehabilitation.assist.participant_record import AssistFile, opened
from exograv.procedures.rehabilitation.assist.session import fly_session
from exograv.procedures.rehabilitation.assist.words import AssistTexts, Language, page_words
from exograv.report.style.page import page_text
from exograv.task.assist_as_needed import SENTENCES

from .weak import Weak, usual

SAID: dict[Language, Mapping[str, str]] = {"en": SENTENCES, "de": said_in("de")}


def sessions(*needs: float) -> AssistFile:
    file = AssistFile(participant="P-07", options={})
    for needed in needs:
        file = file.with_session(fly_session(Weak(needed), opened(file, usual(), None, False), lambda _s, _b: None))
    return file


@pytest.mark.parametrize(
    ("language", "simulated", "said"),
    [("en", "SIMULATED", "support goes down from 100 to 95 %."), ("de", "SIMULIERT", "geht von 100 auf 95 % zurück.")],
)
def test_every_decision_stands_on_the_page_in_its_language(language: Language, simulated: str, said: str):
    file, words = sessions(0.8, 0.7), AssistTexts(language, SAID)
    page = page_text(page_of(file, words))
    assert f'<html lang="{language}">' in page
    assert simulated in page
    assert said in page
    assert page.count("<tr>") == 1 + sum(len(session.blocks) for session in file.sessions)


@pytest.mark.parametrize(
    ("options", "is_simulated"), [({}, True), ({"drives": "simulated"}, True), ({"drives": "real"}, False)]
)
def test_only_the_page_of_a_real_machine_does_not_say_that_it_is_simulated(options: OptionRecord, is_simulated: bool):
    page = page_text(page_of(sessions(0.8).model_copy(update={"options": options}), AssistTexts("en", SAID)))
    assert ("SIMULATED" in page) is is_simulated


def test_both_languages_have_the_same_words_with_the_same_gaps():
    english, german = page_words("en"), page_words("de")
    assert english.keys() == german.keys()
    for name, text in english.items():
        assert set(re.findall(r"{(\w+)}", text)) == set(re.findall(r"{(\w+)}", german[name])), name


def test_the_band_in_the_picture_is_where_support_could_go():
    rows = course(sessions(0.2, 0.2))
    assert {row.session: (row.low, row.high) for row in rows} == {1: (80.0, 100.0), 2: (65.0, 100.0)}


@pytest.mark.slow
def test_the_page_is_written_with_its_picture(tmp_path: Path):
    write_assist_page(tmp_path / "a.html", sessions(0.8), AssistTexts("en", SAID))
    assert "<svg" in (tmp_path / "a.html").read_text(encoding="utf-8")
