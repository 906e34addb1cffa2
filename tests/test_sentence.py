"""A sentence is its English text, and keeps the code and fields that render it in another language."""

import pickle

from pydantic import BaseModel

from exograv.sentence import Sentence, SentenceText, render, say

ENGLISH = {"stopped": "Stopped: {why} {n} times.", "why": "It was late."}
GERMAN = {"stopped": "{n}-mal angehalten. {why}", "why": "Es war spät."}


class Alarm(BaseModel):
    text: SentenceText


def test_a_sentence_is_its_english_text():
    assert say(ENGLISH, "stopped", why=say(ENGLISH, "why"), n=2) == "Stopped: It was late. 2 times."


def test_a_field_that_is_a_sentence_is_rendered_in_the_same_language():
    said = pickle.loads(pickle.dumps(say(ENGLISH, "stopped", why=say(ENGLISH, "why"), n=2)))
    assert said.rendered(GERMAN) == "2-mal angehalten. Es war spät."
    assert render(GERMAN, "stopped", {"why": "x", "n": 1}) == "1-mal angehalten. x"


def test_text_without_a_code_stays_as_it_is():
    assert Sentence("No space left.").rendered(GERMAN) == "No space left."


def test_a_setting_keeps_a_sentence_and_writes_its_text():
    said = say(ENGLISH, "why")
    kept = Alarm(text=said)
    assert kept.text is said
    assert kept.model_dump(mode="json") == {"text": "It was late."}
    assert Alarm.model_validate_json(kept.model_dump_json()).text == said
