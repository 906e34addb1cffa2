"""Files of one session, and the list of these files."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path, PurePosixPath
from typing import Any

import pandas as pd

from exograv.errors import RecordingError
from exograv.recording import read_topics
from exograv.recording.stream_block import StreamBlock
from exograv.recording.stream_pieces import other_pieces
from exograv.study.biosignal_channels import Stated

from .behaviour import NO_SAMPLES, events_of, write_behaviour, write_events
from .devices import DeviceFiles, Devices, Left, device_streams
from .files import MISSING, write_json, write_table
from .motion import TOPICS, MotionSummary, write_motion
from .names import EXO, TASK, SessionPlace
from .pages import NOBODY
from .tracks import tracks

DESCRIPTION = (
    "Touch the centre of a target on a touch screen, return to a resting place near the lap, and repeat this, in "
    "windows of about 22 s."
)
INSTRUCTIONS = "Touch the centre of the target. After each touch return to the resting place, until the window closes."

Begins = dict[PurePosixPath, float]
"""Beginning of each file after the first row of the exoskeleton's motion [s], by the file's path from the root."""

NOT_TOLD = (
    "Manufacturer", "DeviceSerialNumber", "InstitutionName", "InstitutionAddress", "InstitutionalDepartmentName",
)  # fmt: skip
"""Keys that BIDS recommends and a recording does not hold. The publisher of the data set completes them."""

SCANS = {
    "filename": {"Description": "path of the file from the session's folder"},
    "acq_time": {"Description": "beginning of the file, if the date of the recording was stated"},
    "simulated": {"Description": "true if nobody took part", "Levels": {"true": "yes", "false": "no"}},
    "source_sha256": {"Description": "SHA-256 of the raw file from which the file was made"},
}


@dataclass(frozen=True)
class SessionTables:
    """Content of the study's tables for one session."""

    session: Mapping[str, Any]
    """Row of `SESSIONS` as `rows_of` gives it; NA is None."""

    windows: pd.DataFrame
    touches: pd.DataFrame


@dataclass(frozen=True)
class SessionResult:
    """Result of a session's export."""

    left: list[Left]
    """Streams that are not exported, or only as a physiological recording."""

    not_stated: dict[str, list[str]]
    """Names of statements that the study may add, by the type of the stream."""

    motion_rows: int


def write_session(
    root: Path, place: SessionPlace, source: Path, tables: SessionTables, rate_Hz: float, stated: Stated
) -> SessionResult:
    """Write all files of a session.

    Args:
        root: Folder of the data set.
        place: Paths of the session.
        source: Raw file of the session.
        tables: Rows of the session in the study's tables.
        rate_Hz: Wanted rate of the motion.
        stated: Statements of the study about streams of EEG and EMG, by name or type.

    Raises:
        RecordingError: The source cannot be read.
    """
    session, about = tables.session, sidecar_of(tables.session)
    is_recording, rate = session["kind"] == "recording", session["rate_Hz"]
    moved = write_motion(source, root, place, (rate, rate_Hz), about) if is_recording and rate else None
    begins: Begins = {place.behaviour("beh.tsv"): 0.0}
    write_behaviour(root, place, tables.touches, about)
    if moved is None:
        write_events(root / place.behaviour("events.tsv"), events_of(tables.windows, tables.touches), 0.0, about)
        left = device_streams(read_topics(source, TOPICS))[1] if is_recording else []
        _write_scans(root, place, begins, session)
        return SessionResult(left, {}, 0)
    events = events_of(tables.windows, tables.touches, (moved.recording, moved.first_t))
    tracks_begin, devices = _write_others(source, root, place, moved, (about, stated))
    for table, later_s in tracks_begin.items():
        name = table.name.replace("_motion.tsv", "_events.tsv")
        write_events(root / table.with_name(name), events, later_s, about)
    for file in devices.biosignals:
        gaps = [
            {"onset": gap.t - moved.first_t, "duration": gap.seconds, "trial_type": NO_SAMPLES} for gap in file.gaps
        ]
        later_s = begins[file.table] = file.first_t - moved.first_t
        rows = sorted([*events, *gaps], key=lambda row: row["onset"])
        write_events(root / file.events, rows, later_s, about)
    begins |= tracks_begin | devices.physio
    _write_scans(root, place, begins, session)
    not_stated = dict[str, list[str]]()
    for file in devices.biosignals:
        known = not_stated.setdefault(file.kind, [])
        known += [name for name in file.not_stated if name not in known]
    return SessionResult(devices.left, {kind: names for kind, names in not_stated.items() if names}, moved.account.rows)


def sidecar_of(session: Mapping[str, Any]) -> dict[str, Any]:
    """Return the content that all sidecars of a session share."""
    return {
        "TaskName": TASK,
        "TaskDescription": DESCRIPTION,
        "Instructions": INSTRUCTIONS,
        "SoftwareVersions": session["software"],
        "Protocol": session["protocol"],
        "Exoskeleton": session["exo"],
        "Side": session["side"],
        "Simulated": bool(session["simulated"]),
        "SubjectArtefactDescription": NOBODY if session["simulated"] else "n/a",
        "SourceRemark": session["remark"],
        **dict.fromkeys(NOT_TOLD, MISSING),
    }


def _write_others(
    source: Path, root: Path, place: SessionPlace, moved: MotionSummary, said: tuple[Mapping[str, Any], Stated]
) -> tuple[Begins, DeviceFiles]:
    """Write the data that were recorded beside the ticks.

    Args:
        source: The recording.
        root: Folder of the data set.
        place: Paths of the session.
        moved: Motion of the exoskeleton.
        said: Content that all sidecars share, and statements of the study about streams.

    Returns:
        Motion files, including that of the exoskeleton, and files of devices.
    """
    about, stated = said
    points = {track.topic: track for track in tracks()}
    with Devices(root, place, moved.recording, moved.first_t, stated) as devices:
        for topic, message in other_pieces(source, points):
            if isinstance(message, StreamBlock):
                devices.take(topic, message)
            else:
                points[topic].take(message)
        files = devices.finish(about)
    written = [track.write(root, place, moved.first_t, about) for track in points.values() if track.t]
    return {place.motion(EXO, "motion.tsv"): 0.0, **dict(written)}, files


def _write_scans(root: Path, place: SessionPlace, begins: Begins, session: Mapping[str, Any]) -> None:
    rows = [
        {
            "filename": name.relative_to(place.folder).as_posix(),
            "acq_time": _acquired(session["acquired"], begins[name]),
            "simulated": bool(session["simulated"]),
            "source_sha256": session["sha256"],
        }
        for name in sorted(begins)
    ]
    write_table(root / place.scans, list(SCANS), rows)
    write_json((root / place.scans).with_suffix(".json"), SCANS)


def _acquired(told: str | None, later_s: float) -> str | None:
    """Return the beginning of a file, from the beginning of its recording.

    Raises:
        RecordingError: The stated text is not a date and time.
    """
    if told is None:
        return None
    try:
        begun = datetime.fromisoformat(told)
    except ValueError as error:
        raise RecordingError(f"'{told}' is not a date and time by ISO 8601. Correct it in the study.") from error
    at = begun + timedelta(seconds=later_s)
    if at.tzinfo is not None:
        return at.astimezone(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")
    return at.strftime("%Y-%m-%dT%H:%M:%S.%f")
