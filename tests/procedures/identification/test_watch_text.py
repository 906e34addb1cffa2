"""A check of the session is told with size, unit and interval; what cannot be told apart is named as such."""

import numpy as np
import pytest

from exograv.identification.drift.slow_change import Cause, FoundChange, Kind, SlowJudgement
from exograv.procedures.identification.watch_text import SENTENCES, change_text, watch_text


def found(kind: Kind, place: str, size: float, half_width: float) -> FoundChange:
    return FoundChange(Cause(kind, place, (0,)), size, half_width, 0.99, np.zeros(4))


CUFF, ELBOW = found(Kind.CUFF, "forearm", 0.012, 0.005), found(Kind.FRICTION, "elbow_flexion", -0.18, 0.03)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        (CUFF, "The cuff at forearm has moved along the limb by +12 ± 5 mm."),
        (ELBOW, "Friction of elbow_flexion has changed by -18 ± 3 %."),
        (
            found(Kind.CONSTANT, "elbow_flexion", 0.03, 0.01),
            "Torque per current of elbow_flexion has changed by -3 ± 1 %.",
        ),
        (found(Kind.TONE, "abduction", -0.44, 0.2), "The relaxed arm pulls about abduction by -0.4 ± 0.2 N·m."),
        (found(Kind.SHOULDER, "shoulder", 0.01, 0.004), "The wearer's shoulder has moved in the machine by 10 ± 4 mm."),
    ],
)
def test_a_change_is_told_in_its_unit(change: FoundChange, text: str):
    assert change_text(change) == text


def test_every_kind_of_change_has_a_sentence():
    assert {f"watch.{kind.value}" for kind in Kind} <= set(SENTENCES)


def test_changes_that_cannot_be_told_apart_are_not_told_as_facts():
    assert watch_text(SlowJudgement((), (CUFF, ELBOW), 1.0)).startswith("The motion cannot tell apart: The cuff")


def test_a_restless_check_tells_nothing():
    assert watch_text(SlowJudgement((CUFF,), (), 9.0)) == SENTENCES["watch.restless"]


def test_the_second_identification_is_told():
    assert watch_text(SlowJudgement((CUFF,), (), 1.0), True).endswith("The arm was identified again.")
