"""What became of every touch: each is counted, or left out for one reason that is named."""

from dataclasses import dataclass

from exograv.study.measures.selecting import keys, people, rows
from exograv.study.measures.study_data import StudyData

REASONS = {
    "repeated": "sent again by the page",
    "untimed": "its time could not be trusted: the page's clock was not synchronised",
    "outside": "between windows",
    "pointer": "not a finger",
    "second": "a second finger",
    "palm": "as large as a palm",
    "off_target": "too far from the target to be meant for it",
    "bounce": "at once after another",
    "no_return": "the hand had not returned to its resting place",
}
"""Of the task's own judgement, in words; other sources may have others."""

UNIQUE = ["participant", "protocol", "session", "page", "sequence"]
"""What tells touches apart."""

BROKEN_OFF = "in a window that was broken off, or run again later"


@dataclass(frozen=True)
class Exclusion:
    """One reason."""

    reason: str
    touches: int
    people: int


def exclusions(data: StudyData) -> list[Exclusion]:
    """Most frequent first. With the touches that count they make up all that were recorded."""
    touches = data.tables.touches
    refused = rows(touches, ~touches["is_accepted"]).fillna({"reason": "no reason was told"})
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
