"""Everything that the server says to pages, and how a sentence goes over a line: as code and gaps, for any language."""

import re
from collections.abc import Mapping
from functools import cache, lru_cache
from types import MappingProxyType
from typing import Any

from exograv.experiment.steered import sentences as steered
from exograv.task import assist_as_needed
from exograv.task import operator_events as operating

OWN: Mapping[str, str] = MappingProxyType(
    {
        "console.clock_unknown": "The page's clock is not known yet. Press again.",
        "console.not_steering": "Another page steers, or this one was silent for too long. Press Steer.",
        "console.other_steers": "Another page steers. It has to be closed first.",
        "console.not_allowed": "This page may not do that.",
        "console.level_is_set": "The protocol sets the gravity level now. Pause or end it first.",
        "console.runs": "The protocol runs with this person and this arm. Pause or end it first.",
        "console.in_flight": "In flight the machine only records: its model knows of one gravity.",
        "console.no_protocol": "No protocol was given. Start the console with --protocol.",
        "console.late": "This came too late, and was not done.",
        "console.no_alarm": "There is no such alarm any more.",
        "console.too_many": "Too many words at once. Wait for their answers.",
        "trial.needs_arm": "This protocol needs a machine that carries the arm. Make it ready and take the arm first.",
        "trial.other_side": "The run was begun with the {begun} arm, and the {side} one is in the machine.",
        "trial.refused": "Not now: {why}.",
        "trial.paused": "The run is paused: the machine does not carry the arm any more.",
        "trial.not_kept": "The run is not kept. {why}",
        "alarm.role": "A {role} page asked for '{word}', and was refused.",
        "alarm.closed": "The page that steers is closed.",
        "alarm.silent": "The page that steers (line {line}) is silent.",
        "alarm.wrong_link": "Somebody tried to come in with a wrong link.",
        "alarm.diary": "{path} cannot be written: {why}. Make room on the disk.",
        "aircraft.not_heard": "The run has begun, and the aircraft was not heard yet: open and close windows by hand.",
        "aircraft.contradicted": operating.CONTRADICTED,
        "aircraft.lost": operating.FEED_LOST,
        "aircraft.lost_in_window": operating.FEED_LOST_IN_WINDOW,
    }
)
SENTENCES: Mapping[str, str] = MappingProxyType({**steered.SENTENCES, **assist_as_needed.SENTENCES, **OWN})
"""English, with gaps; a page has the same under `said.` and the code in every other language."""

GAP = re.compile(r"\{(\w+)\}")


def say(code: str, **gaps: object) -> str:
    """One of our own, filled."""
    return OWN[code].format(**gaps)


@cache
def _forms() -> tuple[tuple[str, re.Pattern[str]], ...]:
    """Codes and forms; those with most of their own words first."""
    forms = []
    for code, text in SENTENCES.items():
        parts = GAP.split(text)
        form = "".join(f"(?P<{part}>.+)" if i % 2 else re.escape(part) for i, part in enumerate(parts))
        forms.append((sum(map(len, parts[::2])) - 1000 * ("{" in text), code, re.compile(form, re.DOTALL)))
    return tuple((code, form) for _, code, form in sorted(forms, key=lambda each: -each[0]))


@lru_cache(512)
def _recognised(text: str) -> tuple[str, Mapping[str, str]]:
    for code, form in _forms():
        if found := form.fullmatch(text):
            return code, found.groupdict()
    return "", {}


def spoken(text: str) -> dict[str, Any]:
    """As it goes over a line: the English text, its code and what fills the gaps; no code where a page cannot know it.

    What comes from files and from an operating system is such: it stays as it is.
    """
    code, gaps = _recognised(text)
    return {"text": text, "code": code, "gaps": {name: spoken(gap) for name, gap in gaps.items()}}
