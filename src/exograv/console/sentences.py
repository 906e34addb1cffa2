"""English table of the server's sentences to the pages, and the form of a sentence on a line."""

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
        "console.not_steering": "Another page steers, or this page was silent for too long. Press Steer.",
        "console.other_steers": "Another page steers. Close it first.",
        "console.not_allowed": "This page is not allowed to do that.",
        "console.level_is_set": "The protocol sets the weight support now. Pause or end the protocol first.",
        "console.runs": "The protocol runs with this person and this arm. Pause or end the protocol first.",
        "console.in_flight": "In flight the machine only records: its model assumes a constant gravity.",
        "console.no_protocol": "No protocol was given. Start the console with --protocol.",
        "console.late": "This request came too late and was not carried out. Press again.",
        "console.no_alarm": "This alarm does not exist any more.",
        "console.too_many": "Too many requests at once. Wait for the answers.",
        "trial.needs_arm": "This protocol needs a machine that carries the arm. Make it ready and take the arm first.",
        "trial.window_open": "A window is open. The machine learns between two windows.",
        "trial.window_soon": (
            "The next window opens in {left} s, and learning in a rest needs {seconds} s. Pause the protocol first, or "
            "wait for a longer rest."
        ),
        "trial.other_side": "The run began with the {begun} arm, but the {side} arm is in the machine.",
        "trial.refused": "Not now: {why}.",
        "trial.paused": "The run is paused: the machine does not carry the arm any more.",
        "trial.not_agreed": "The run is paused: the participant has not agreed that the machine pushes the arm down.",
        "trial.not_kept": "The state of the run is not saved. {why}",
        "alarm.role": "A {role} page asked for '{word}', and was refused.",
        "console.ended": "The session has ended: the server was closed. The machine lets the arm down.",
        "console.failed": (
            "The console failed, and the session has ended. The machine lets the arm down. Read the terminal's message."
        ),
        "lease.closed": (
            "Page {line} no longer steers: it was closed or reloaded, or its connection broke. Open it again; if it "
            "does not steer by itself, press Steer."
        ),
        "lease.refused": (
            "Page {line} no longer steers: the server closed its line after a message that is not allowed. Reload the "
            "page, then press Steer."
        ),
        "lease.silent": (
            "Page {line} no longer steers: it was silent for {seconds} s (network, or a browser that was too slow). "
            "Check both, then press Steer."
        ),
        "lease.hidden": (
            "Page {line} no longer steers: it was in the background, where the browser slows it down ({seconds} s "
            "silent). Keep the page in view, then press Steer."
        ),
        "lease.slow": (
            "Page {line} no longer steers: its browser was too slow ({seconds} s without a sign). Close other programs "
            "and tabs, then press Steer."
        ),
        "lease.asleep": (
            "Page {line} no longer steers: its computer slept for {seconds} s. Switch off its power saving, then press "
            "Steer."
        ),
        "lease.server_slow": (
            "Page {line} no longer steers: the computer of this server was too slow ({seconds} s). End other programs "
            "there, then press Steer."
        ),
        "alarm.silent": "The steering page (line {line}) is silent.",
        "alarm.wrong_link": "A wrong link was used to log in.",
        "alarm.diary": "{path} cannot be written: {why}. Free space on the disk.",
        "aircraft.not_heard": "The run has begun without data from the aircraft: open and close windows by hand.",
        **operating.SENTENCES,
    }
)
SENTENCES: Mapping[str, str] = MappingProxyType({**steered.SENTENCES, **assist_as_needed.SENTENCES, **OWN})
"""English texts with placeholders by code. A page has the text of each other language under `said.` and the code."""

say = partial(sentence.say, SENTENCES)


def spoken(text: str) -> dict[str, Any]:
    """Return a sentence in the form of a line: English text, code and fields.

    Texts of files and of an operating system have no code: a page shows them unchanged.
    """
    code, fields = (text.code, text.fields) if isinstance(text, Sentence) else ("", {})
    return {"text": str(text), "code": code, "gaps": {name: spoken(field) for name, field in fields.items()}}
