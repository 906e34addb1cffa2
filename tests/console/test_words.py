"""Every text that a page shows exists in both languages, and no text is unused."""

import json
import re
from pathlib import Path
from typing import get_args

import pytest

from exograv.console.page_files import PAGES
from exograv.console.sentences import SENTENCES
from exograv.dynamics.parameters import names_and_units
from exograv.experiment.steered.process_state import SHOWN_UNITS
from exograv.experiment.steered.view_models import ModeName, SafeStateName
from exograv.model.anthropometry import Body
from exograv.model.description import load_rig
from exograv.model.support import assemble
from exograv.runtime.lsl.quality import StreamCondition

LANGUAGES = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (PAGES / "words").glob("*.json")}
TEXT = "\n".join(path.read_text(encoding="utf-8") for path in PAGES.glob("*") if path.suffix in (".html", ".js"))
FAMILIES = (
    "mode", "status", "phase", "role", "arrow", "participant", "side", "feed", "line", "work", "joint",
    "parameter", "of", "safe", "stream",
)  # fmt: skip
"""Families of texts whose names end with a state."""


GAP = re.compile(r"\{(\w+)\}")
OF_SERVER = "said."
"""Prefix of the server's sentences. Their English text comes from the server."""


def gaps(text: str) -> set[str]:
    return set(GAP.findall(text))


def used() -> set[str]:
    quoted = set(re.findall(r'["`]([a-z]+(?:\.[a-z_]+)+)["`]', TEXT)) | set(re.findall(r'data-word="([^"]+)"', TEXT))
    return {word for word in quoted if word.split(".")[0] in {name.split(".")[0] for name in LANGUAGES["en"]}}


def test_both_languages_have_the_same_words_and_the_same_gaps_in_them():
    english = LANGUAGES["en"] | {OF_SERVER + code: text for code, text in SENTENCES.items()}
    german = LANGUAGES["de"]
    assert english.keys() == german.keys()
    for name, text in english.items():
        assert gaps(text) == gaps(german[name]), name


def test_what_pages_use_is_there_and_what_is_there_is_used():
    known = set(LANGUAGES["en"])
    assert used() - known == set()
    assert {name for name in known - used() if not name.startswith(FAMILIES)} == set()


def test_every_mode_has_its_words():
    assert {f"mode.{mode}" for mode in get_args(ModeName)} <= set(LANGUAGES["en"])
    assert {f"safe.{state}" for state in get_args(SafeStateName)} <= set(LANGUAGES["en"])


def own(name: str) -> str:
    return re.sub(r"^(right|left)_", "", name)


@pytest.mark.parametrize("rig", sorted(path.name for path in Path("robots").iterdir() if path.is_dir()))
def test_every_joint_and_every_shown_parameter_of_every_machine_has_its_words(rig: str):
    description = load_rig(rig)
    names = {f"joint.{own(joint)}" for joint in description.joints}
    for name, unit in names_and_units(assemble(description, Body(1.75, 75.0, "male", {}))):
        names |= {f"parameter.{own(name)}"} if unit in SHOWN_UNITS else set()
    assert names <= set(LANGUAGES["en"])


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_page_calls_its_button_an_emergency_stop(language: str):
    said = " ".join(LANGUAGES[language].values()) + TEXT
    assert not re.search(r"\be-?stop\b|emergency stop button", said, flags=re.IGNORECASE)
    assert LANGUAGES[language]["stop"] in ("Stop", "Stopp")


def test_every_condition_of_a_stream_has_its_words():
    assert {f"stream.{condition.value}" for condition in StreamCondition} <= set(LANGUAGES["en"])
