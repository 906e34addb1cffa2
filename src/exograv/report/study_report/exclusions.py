"""Account of all touches: each one is used, or left out for one named reason."""

from dataclasses import dataclass

from exograv.study.measures.selecting import keys, people, rows
from exograv.study.measures.study_data import StudyData

REASONS = {
    "repeated": "sent twice by the page",
    "untimed": "unreliable time: the page's clock was not synchronised",
    "outside": "between windows",
    "pointer": "not a finger",
    "second": "a second finger",
    "palm": "as large as a palm",
    "off_target": "too far from the target for an aimed touch",
    "bounce": "immediately after another touch",
    "no_return": "the hand had not returned to its resting place",
}
"""Words by the task's reason of rejection. Other sources may have other reasons."""

UNIQUE = ["participant", "protocol", "session", "page", "sequence"]
"""Columns that identify a touch."""

BROKEN_OFF = "in a window that was interrupted, or run again later"


@dataclass(frozen=True)
class Exclusion:
    """Reason of exclusion with its counts."""

    reason: str
    touches: int
    people: int


def exclusions(data: StudyData) -> list[Exclusion]:
    """Return the exclusions, most frequent first. With the used touches they add up to all recorded touches."""
    touches = data.tables.touches
    refused = rows(touches, ~touches["is_accepted"]).fillna({"reason": "no reason was stated"})
    found = [
        Exclusion(REASONS.get(str(reason), str(reason)), len(of), people(of))
        for reason, of in refused.groupby("reason")
    ]
    accepted = rows(touches, touches["is_accepted"])
    kept = set(keys(data.touches, UNIQUE))
    lost = rows(accepted, [key not in kept for key in keys(accepted, UNIQUE)])
    if len(lost):
        found.append(Exclusion(BROKEN_OFF, len(lost), people(lost)))
    return sorted(found, key=lambda one: (-one.touches, one.reason))
