"""Data quality: missing, truncated, uncalibrated or unsynchronised data, each named and counted, never hidden."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from exograv.report.study_figures.quality import missing_sessions
from exograv.study.dataset.quarantine import QuarantineNote
from exograv.study.dataset.status import in_words
from exograv.study.folder.journal import JournalEntry
from exograv.study.measures.selecting import column, keys, rows
from exograv.study.measures.study_data import StudyData
from exograv.study.measures.table import SESSION

MOST_NAMED = 12


@dataclass(frozen=True)
class Issue:
    """Kind of flaw with its places."""

    what: str
    count: int
    which: str
    """Names of the places, as far as there is room."""

    consequence: str
    """Consequence for the analysis."""


@dataclass(frozen=True)
class QualityStatement:
    """Statements of the folder beside its tables."""

    quarantined: Mapping[str, QuarantineNote] = field(default_factory=dict)
    """Reason and participant by the hash of a file."""

    journal: Sequence[JournalEntry] = ()
    remarks: Sequence[str] = ()
    """Remarks on recordings whose ticks could not be read."""


def issues(data: StudyData, told: QualityStatement) -> list[Issue]:
    """Return all flaws of the data."""
    return [*_of_people(data), *_of_sessions(data), *_of_windows(data), *_of_touches(data), *_of_folder(told)]


def _of_people(data: StudyData) -> Iterator[Issue]:
    people, sessions = data.tables.participants, data.tables.sessions
    missing = missing_sessions(data)
    numbers = dict[str, list[int]]()
    for code, protocol, session in missing:
        numbers.setdefault(f"{code} {protocol}", []).append(session)
    which = [f"{whose} {in_words(tuple(of))}" for whose, of in numbers.items()]
    if which:
        what = "expected sessions that are missing"
        yield Issue(what, len(missing), _shortened(which), "no values are substituted")
    idle = sorted(set(people["participant"]) - set(sessions["participant"]))
    yield from _issue("participants without any session", idle, "not in any figure")
    if data.is_sealed:
        sealed = people.loc[people["group"].isna(), "participant"].tolist()
        yield from _issue("participants whose group is sealed", sealed, "no group is shown")


def _of_sessions(data: StudyData) -> Iterator[Issue]:
    s = data.tables.sessions
    name = s["participant"] + " " + s["protocol"] + " " + s["session"].astype(str)
    active = s["exo"].fillna("") == "active"
    pitches = _varies(s.assign(pitch_x_mm=s["pitch_x_mm"].round(3)), "participant", "pitch_x_mm")
    codes, files = _varies(s, "protocol", "software"), _varies(s, "protocol", "protocol_sha256")
    flaws = (
        ("sessions that did not run to their end", ~s["is_complete"], "their complete windows are used"),
        ("sessions on a screen that was not calibrated", s["pitch_x_mm"].isna(), "in px only"),
        ("sessions with an active machine without calibration", active & s["calibration_sha256"].isna(), "used"),
        ("sessions in which a clock jumped", s["clock_jumps"] > 0, "used, without intervals over the jump"),
        ("sessions with lost ticks", s["ticks_lost"].fillna(0) > 0, "reaches over a gap are not measured"),
        ("sessions with stops", s["stops"] > 0, "interrupted windows are left out"),
        ("sessions of people with screens of different pixel size", pitches, "compare them in mm"),
        ("sessions of a protocol with several versions", files, "used together"),
        ("sessions of a protocol recorded with several versions of the software", codes, "used together"),
    )
    remarked, said = s["remark"].notna(), [*SESSION, "remark"]
    told = [
        f"{code} {protocol} {n}: {remark.rstrip('.')}" for code, protocol, n, remark in keys(rows(s, remarked), said)
    ]
    yield from _issue("sources with remarks", told, "the readable part is used")
    for what, is_flawed, consequence in flaws:
        yield from _issue(what, name[np.asarray(is_flawed, bool)].tolist(), consequence)


def _varies(sessions: pd.DataFrame, within: str, name: str) -> list[bool]:
    """Return for each session True if others of the same person or protocol have another value."""
    values = dict[str, set[object]]()
    told = keys(sessions, [within, name])
    for whose, value in told:
        values.setdefault(whose, set()).update(() if pd.isna(value) else (value,))
    return [len(values[whose]) > 1 for whose, _ in told]


def _of_windows(data: StudyData) -> Iterator[Issue]:
    w = data.tables.windows
    name = (
        w["participant"] + " " + w["protocol"] + " " + w["session"].astype(str) + " window " + w["window"].astype(str)
    )
    yield from _issue("interrupted windows", name[~w["is_complete"]].tolist(), "left out")
    marks = [{mark.strip() for mark in marks.split(";")} for marks in column(w, "marks")]
    for mark in sorted(set().union(*marks) - {""}):
        yield from _issue(f"windows marked `{mark}`", name[[mark in of for of in marks]].tolist(), "used")
    s = data.tables.sessions
    s = s.assign(lacking=(s["windows_planned"].fillna(0).astype(int) - s["windows_complete"]).clip(lower=0))
    which = [f"{code} {protocol} {n}: {k}" for code, protocol, n, k in keys(s, [*SESSION, "lacking"]) if k]
    if which:
        count = sum(column(s, "lacking").tolist())
        yield Issue("planned windows that are missing", count, _shortened(which), "no values are substituted")


def _of_touches(data: StudyData) -> Iterator[Issue]:
    touches = data.tables.touches
    untimed = rows(touches, touches["reason"] == "untimed")
    yield from _counted_by_person("touches without a reliable time (clock not synchronised)", untimed, "left out")
    elsewhere = rows(touches, touches["is_accepted"] & touches["window"].isna())
    yield from _counted_by_person("accepted touches outside of all windows", elsewhere, "left out")


def _counted_by_person(what: str, touches: pd.DataFrame, consequence: str) -> Iterator[Issue]:
    if len(touches):
        counts = column(touches, "participant").value_counts().sort_index()
        which = [f"{code}: {count}" for code, count in counts.items()]
        yield Issue(what, len(touches), _shortened(which), consequence)


def _of_folder(told: QualityStatement) -> Iterator[Issue]:
    aside = [why.reason for why in told.quarantined.values()]
    yield from _issue("files in quarantine", aside, "not used")
    for what, words in {"refused": "refused files or lines", "erased": "erased participants"}.items():
        said = [entry.sentence for entry in told.journal if entry.what == what]
        yield from _issue(words, said, "see log.jsonl")
    yield from _issue("recordings whose movements could not be read", list(told.remarks), "their touches are used")


def _issue(what: str, which: Sequence[str], consequence: str) -> Iterator[Issue]:
    if which:
        yield Issue(what, len(which), _shortened(which), consequence)


def _shortened(which: Sequence[str]) -> str:
    more = f" and {len(which) - MOST_NAMED} more" if len(which) > MOST_NAMED else ""
    return ", ".join(which[:MOST_NAMED]) + more
