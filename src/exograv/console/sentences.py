"""English table of everything that the server says to pages, and a sentence on its way over a line."""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType
from typing import Any

from exograv import sentence
from exograv.experiment.steered import sentences as steered
from exograv.sentence import Sentence
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
        **operating.SENTENCES,
    }
)
SENTENCES: Mapping[str, str] = MappingProxyType({**steered.SENTENCES, **assist_as_needed.SENTENCES, **OWN})
"""English, with gaps; a page has the same under `said.` and the code in every other language."""

say = partial(sentence.say, SENTENCES)


def spoken(text: str) -> dict[str, Any]:
    """A sentence as it goes over a line: the English text, its code and its fields.

    Texts of files and of an operating system have no code: a page shows them as they are.
    """
    code, fields = (text.code, text.fields) if isinstance(text, Sentence) else ("", {})
    return {"text": str(text), "code": code, "gaps": {name: spoken(field) for name, field in fields.items()}}
