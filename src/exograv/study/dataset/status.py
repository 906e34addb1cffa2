"""Who has which sessions, what is missing, and what is wrong with what is there."""

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
"""Of sessions, by protocol."""


@dataclass(frozen=True)
class PersonStatus:
    """One participant."""

    participant: str
    group: str
    touches: int
    sessions: Numbers
    missing: Numbers
    """Sessions that are expected and not there."""

    incomplete: Numbers
    """Sessions that are there and were not run to their end."""


@dataclass(frozen=True)
class StudyStatus:
    """The whole."""

    name: str
    is_simulated: bool
    participants: tuple[PersonStatus, ...]
    sessions: int
    missing: int
    remarks: Mapping[str, str]
    """What is wrong with a session, by its name."""

    quarantined: Mapping[str, str]
    """Reasons, by the hash of the file."""

    refused: int
    """Files that were refused and have not come in since, by the log."""


def study_status(folder: StudyFolder, everything: bool = False) -> StudyStatus:
    """What there is, with the tables brought up to date.

    Args:
        folder: The study's.
        everything: Make all tables anew.

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
    """Each file once, however often it was tried, and not if it came in after all."""
    there = {source.note.given_sha256 for source in placed_sources(folder)}
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
    """Whole numbers as runs: `1–4, 7`."""
    runs = list[list[int]]()
    for number in numbers:
        if runs and number == runs[-1][1] + 1:
            runs[-1][1] = number
        else:
            runs.append([number, number])
    return ", ".join(str(first) if first == last else f"{first}–{last}" for first, last in runs)
