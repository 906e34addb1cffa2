"""Whether a recording is of the person whose code it has, as far as body data can tell."""

from collections.abc import Sequence

from exograv.study.participants.participant_record import ParticipantRow

from .sources import RecordedBody, SourceNote

HEIGHT_M, MASS_KG = 0.03, 6.0
"""What one person may differ by from tape to tape; the same as for a kept arm (docs/howto/participants.md)."""


def same_person(body: RecordedBody, told: ParticipantRow, others: Sequence[SourceNote]) -> str | None:
    """A sentence where they contradict; None where nothing does.

    Args:
        body: Of the recording.
        told: What the study was told of the participant.
        others: Sessions that are there under the same code.
    """
    height_cm = None if body.height_m is None else 100.0 * body.height_m
    against = []
    if _outside(height_cm, told.height_band_cm, 100.0 * HEIGHT_M) or _outside(body.mass_kg, told.mass_band_kg, MASS_KG):
        against.append("what the study was told")
    if body.sex and told.sex and body.sex[0] != told.sex:
        against.append("the sex that was told")
    if any(_differ(body, other.body) for other in others):
        against.append("another session under this code")
    if not against:
        return None
    return f"Body data contradict {' and '.join(against)}: do two people have one code?"


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
