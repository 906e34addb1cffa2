"""Every word that a page shows is there in both languages, and none is left over."""

import json
import re
from typing import get_args

import pytest

from exograv.console.server import PAGES
from exograv.session.steered.shown import ModeName

LANGUAGES = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (PAGES / "words").glob("*.json")}
TEXT = "\n".join(path.read_text(encoding="utf-8") for path in PAGES.glob("*") if path.suffix in (".html", ".js"))
FAMILIES = ("mode", "status", "phase", "role", "arrow", "participant", "side", "feed")
"""Whose last word is a state."""


def used() -> set[str]:
    quoted = set(re.findall(r'["`]([a-z]+(?:\.[a-z_]+)+)["`]', TEXT)) | set(re.findall(r'data-word="([^"]+)"', TEXT))
    return {word for word in quoted if word.split(".")[0] in {name.split(".")[0] for name in LANGUAGES["en"]}}


def test_both_languages_have_the_same_words_and_the_same_gaps_in_them():
    english, german = LANGUAGES["en"], LANGUAGES["de"]
    assert english.keys() == german.keys()
    for name, text in english.items():
        assert set(re.findall(r"\{\w+\}", text)) == set(re.findall(r"\{\w+\}", german[name])), name


def test_what_pages_use_is_there_and_what_is_there_is_used():
    known = set(LANGUAGES["en"])
    assert used() - known == set()
    assert {name for name in known - used() if not name.startswith(FAMILIES)} == set()


def test_every_mode_has_its_words():
    assert {f"mode.{mode}" for mode in get_args(ModeName)} <= set(LANGUAGES["en"])


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_page_calls_its_button_an_emergency_stop(language: str):
    said = " ".join(LANGUAGES[language].values()) + TEXT
    assert not re.search(r"\be-?stop\b|emergency stop button", said, flags=re.IGNORECASE)
    assert LANGUAGES[language]["stop"] in ("Stop", "Stopp")
