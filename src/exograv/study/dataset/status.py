"""Status of a study: sessions of each participant, missing sessions, and problems of the stored files."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from exograv.study.folder.journal import alone, read_journal
from exograv.study.folder.settings import StudySettings, read_settings
from exograv.study.folder.study_folder import StudyFolder
from exograv.study.participants.participant_record import ParticipantRow
from exograv.study.participants.register import read_register

from .making import refresh
from .quarantine import quarantined
from .sources import placed_sources, remove_partial

Numbers = Mapping[str, tuple[int, ...]]
"""Numbers of sessions by protocol."""


@dataclass(frozen=True)
class PersonStatus:
    """Status of one participant."""

    participant: str
    group: str
    touches: int
    sessions: Numbers
    missing: Numbers
    """Sessions that are expected but missing."""

    incomplete: Numbers
    """Sessions that exist but were not run to their end."""


@dataclass(frozen=True)
class StudyStatus:
    """Status of the whole study."""

    name: str
    is_simulated: bool
    is_unfinished: bool
    """True if the command that makes this study was interrupted, or still runs."""

    participants: tuple[PersonStatus, ...]
    sessions: int
    missing: int
    remarks: Mapping[str, str]
    """Problems of sessions, by the session's name."""

    quarantined: Mapping[str, str]
    """Reasons of quarantine, by the hash of the file."""

    refused: int
    """Number of refused files that were not added later, by the log."""


def study_status(folder: StudyFolder, everything: bool = False) -> StudyStatus:
    """Return the status of a study, and bring its tables up to date.

    Args:
        folder: Folder of the study.
        everything: Make all tables again.

    Raises:
        ConfigError: The folder is no study, or another command is changing it.
        RecordingError: A source cannot be read any more.
    """
    settings = read_settings(folder)
    with alone(folder):
        remove_partial(folder)
        tables = refresh(folder, everything=everything)
    sessions = tables.sessions.to_dict("records")
    rows = read_register(folder)
    people = tuple(_person(row, settings, [one for one in sessions if one["participant"] == row.code]) for row in rows)
    return StudyStatus(
        settings.name,
        settings.is_simulated,
        folder.is_unfinished,
        people,
        sum(len(numbers) for person in people for numbers in person.sessions.values()),
        sum(len(numbers) for person in people for numbers in person.missing.values()),
        {
            f"{one['protocol']} {one['session']} of {one['participant']}": one["remark"]
            for one in sessions
            if isinstance(one["remark"], str)
        },
        {sha256: why.reason for sha256, why in quarantined(folder).items()},
        _refused(folder),
    )


def _refused(folder: StudyFolder) -> int:
    """Count each refused file once, and leave out files that were added later."""
    there = {sha256 for source in placed_sources(folder) for sha256 in source.note.given}
    entries = [entry for entry in read_journal(folder) if entry.what == "refused"]
    return len({entry.sha256 or entry.sentence for entry in entries} - there)


def _person(row: ParticipantRow, settings: StudySettings, sessions: list[dict[Any, Any]]) -> PersonStatus:
    there = dict[str, list[int]]()
    incomplete = dict[str, list[int]]()
    for one in sessions:
        there.setdefault(one["protocol"], []).append(int(one["session"]))
        if not one["is_complete"]:
            incomplete.setdefault(one["protocol"], []).append(int(one["session"]))
    missing = dict[str, tuple[int, ...]]()
    for protocol, count in settings.expected_of(row.group).items():
        lacking = set(range(1, count + 1)) - set(there.get(protocol, ()))
        if lacking:
            missing[protocol] = tuple(sorted(lacking))
    return PersonStatus(
        row.code,
        row.group,
        sum(int(one["touches"]) for one in sessions),
        {name: tuple(sorted(numbers)) for name, numbers in there.items()},
        missing,
        {name: tuple(sorted(numbers)) for name, numbers in incomplete.items()},
    )


def in_words(numbers: tuple[int, ...]) -> str:
    """Format whole numbers as ranges: `1–4, 7`."""
    runs = list[list[int]]()
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(str(first) if first == last else f"{first}–{last}" for first, last in runs)
