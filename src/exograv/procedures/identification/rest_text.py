"""Sentences for the operator about learning in rests: decision, certainty and what helps."""

from collections.abc import Mapping
from enum import Enum
from functools import partial
from types import MappingProxyType

import numpy as np

from exograv import sentence
from exograv.identification.core.left_over import TARGET_NM
from exograv.model.description import RigDescription
from exograv.sentence import Sentence

from .rest_learning import REST_MOTION_S, RestLearned, Verdict


class RestPhase(Enum):
    """Part of a rest; the value is a sentence for operator and participant."""

    WEIGHT = "The machine takes the arm's weight."
    WAY = "The machine moves the arm to the start of the motion."
    MOVES = "The machine moves the arm and learns it."
    BACK = "The machine moves the arm back."
    LEARNS = "The machine holds the arm and computes."
    FLOATS = "The machine lets the arm float."


SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        "rest.begins": "In this rest the machine moves the arm for {seconds} s and learns it. Relax the arm.",
        "rest.sure": "After {seconds} s of motion the residual torque is stated as {stated} N·m.",
        "rest.reached": "The target is reached on all axes. Further rests need no motion.",
        "rest.shown": "The rest has shown most about {joint}: {before} → {after} N·m.",
        "rest.missing": (
            "{joint} is farthest from its target, {target} N·m. Ask the person to relax in the next rest and to hold "
            "nothing."
        ),
        **{f"rest.{verdict.name.lower()}": verdict.value for verdict in Verdict},
        **{f"rest.phase_{phase.name.lower()}": phase.value for phase in RestPhase},
    }
)
"""Texts in English by code, with placeholders."""

say = partial(sentence.say, SENTENCES)


def begins_text() -> Sentence:
    """Announce the motion, to operator and participant."""
    return say("rest.begins", seconds=f"{REST_MOTION_S:.0f}")


def phase_text(phase: RestPhase) -> Sentence:
    """State the part of a rest in which the machine is."""
    return say(f"rest.phase_{phase.name.lower()}")


def rest_text(learned: RestLearned, description: RigDescription) -> str:
    """State decision, certainty, and what the operator may do."""
    return " ".join(rest_sentences(learned, description))


def rest_sentences(learned: RestLearned, description: RigDescription) -> tuple[Sentence, ...]:
    """Sentences of `rest_text`; the last one says what the operator may do."""
    target = np.array([TARGET_NM[place] for place in description.places])
    worst = int((learned.stated_Nm / target).argmax())
    stated = ", ".join(f"{value:.2f}" for value in learned.stated_Nm)
    lowered = learned.before_Nm - learned.stated_Nm
    most = int((lowered / target).argmax())
    shown = say(
        "rest.shown",
        joint=description.joints[most],
        before=f"{learned.before_Nm[most]:.2f}",
        after=f"{learned.stated_Nm[most]:.2f}",
    )
    return (
        say(f"rest.{learned.verdict.name.lower()}"),
        *([shown] if lowered[most] > 0.0 else []),
        say("rest.sure", seconds=f"{learned.motion_s:.0f}", stated=stated),
        say("rest.reached")
        if learned.stated_Nm[worst] <= target[worst]
        else say("rest.missing", joint=description.joints[worst], target=f"{target[worst]:.3g}"),
    )
