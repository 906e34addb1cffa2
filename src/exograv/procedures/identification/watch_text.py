"""Sentences for the operator: slow changes that a check of the session has found."""

from collections.abc import Mapping
from functools import partial
from types import MappingProxyType

from exograv import sentence
from exograv.identification.drift.slow_change import FoundChange, Kind, SlowJudgement
from exograv.sentence import Sentence

SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "watch.cuff": "The cuff at {place} has moved along the limb by {size} ± {half_width} mm.",
        "watch.shoulder": "The wearer's shoulder has moved in the machine by {size} ± {half_width} mm.",
        "watch.warm_up": "Friction of all drives has changed by {size} ± {half_width} %.",
        "watch.friction": "Friction of {place} has changed by {size} ± {half_width} %.",
        "watch.constant": "Torque per current of {place} has changed by {size} ± {half_width} %.",
        "watch.tone": "The relaxed arm pulls about {place} by {size} ± {half_width} N·m.",
        "watch.one_of": "The motion cannot tell apart: {changes}",
        "watch.restless": "The person does not relax, so the check tells nothing. Ask the person to relax.",
        "watch.nothing": "The arm is as it was identified.",
        "watch.again": "{changes} The arm was identified again.",
    }
)
"""Texts in English by code, with placeholders."""

say = partial(sentence.say, SENTENCES)

SCALES = {Kind.CUFF: 1e3, Kind.SHOULDER: 1e3, Kind.WARM_UP: 100.0, Kind.FRICTION: 100.0, Kind.CONSTANT: -100.0}
"""Factor from the size of a change to the shown number. A motor that gives less than its current says is negative."""


def change_text(found: FoundChange) -> Sentence:
    """State a change with its size and interval."""
    kind, factor = found.cause.kind, SCALES.get(found.cause.kind, 1.0)
    digits = 1 if kind is Kind.TONE else 0
    sign = "" if kind is Kind.SHOULDER else "+"
    numbers = {
        "size": f"{factor * found.size:{sign}.{digits}f}",
        "half_width": f"{abs(factor) * found.half_width:.{digits}f}",
    }
    return say(f"watch.{kind.value}", place=found.cause.place, **numbers)


def watch_text(judgement: SlowJudgement, is_learned_again: bool = False) -> str:
    """State the result of a check."""
    if judgement.is_restless:
        return say("watch.restless")
    parts = [change_text(found) for found in judgement.changes]
    if judgement.one_of:
        parts.append(say("watch.one_of", changes=" ".join(change_text(found) for found in judgement.one_of)))
    text = " ".join(parts) or say("watch.nothing")
    return say("watch.again", changes=text) if is_learned_again else text
