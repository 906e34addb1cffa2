"""Check of body data: contradictions between a recording and the participant whose code it has."""

from collections.abc import Sequence

from exograv.study.participants.participant_record import ParticipantRow

from .sources import RecordedBody, SourceNote

HEIGHT_M, MASS_KG = 0.03, 6.0
"""Accepted differences between two measurements of one person [m, kg]; the same as for a stored arm
(docs/howto/participants.md).
"""


def same_person(body: RecordedBody, told: ParticipantRow, others: Sequence[SourceNote]) -> str | None:
    """Return a sentence that names the contradictions; None if there are none.

    Args:
        body: Body data of the recording.
        told: Record of the participant in the study.
        others: Other sessions under the same code.
    """
    height_cm = None if body.height_m is None else 100.0 * body.height_m
    against = []
    if _outside(height_cm, told.height_band_cm, 100.0 * HEIGHT_M) or _outside(body.mass_kg, told.mass_band_kg, MASS_KG):
        against.append("the participant's record in the study")
    if body.sex and told.sex and body.sex[0] != told.sex:
        against.append("the recorded sex")
    if any(_differ(body, other.body) for other in others):
        against.append("another session under this code")
    if not against:
        return None
    return f"Body data contradict {' and '.join(against)}: check if two people have the same code."


def _outside(value: float | None, band: str | None, margin: float) -> bool:
    if value is None or band is None:
        return False
    low, high = map(int, band.split("-"))
    return not low - margin <= value <= high + 1 + margin


def _differ(one: RecordedBody, other: RecordedBody) -> bool:
    return (
        _apart(one.height_m, other.height_m, HEIGHT_M)
        or _apart(one.mass_kg, other.mass_kg, MASS_KG)
        or bool(one.sex and other.sex and one.sex != other.sex)
    )


def _apart(one: float | None, other: float | None, margin: float) -> bool:
    return one is not None and other is not None and abs(one - other) > margin
