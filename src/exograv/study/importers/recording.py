"""Import of our own recordings: rows from the task's records, completed by ticks, events and the aircraft's data."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from exograv.recording import Recording, RecordingPass
from exograv.recording.schema import REST_PASSED

from .imported_session import Imported, StatedSession, counted, sentences, totals
from .task_records import records_of, touches_of, windows_of
from .tick_account import TickAccount

JOINED_EVENT = "recording begins"
"""Kind of the event at the seam between two recordings of a session."""

WITHOUT_TICKS = (JOINED_EVENT, REST_PASSED)
"""Kinds of events that explain a jump of the clock."""

TOPICS = ("/task", "/event", "/result", "/timing", "/aircraft")


def import_recording(path: Path) -> Imported:
    """Import the session of a recording. A truncated or damaged recording gives its readable beginning, with a remark.

    Raises:
        RecordingError: The file is not a recording of exograv, or its version cannot be read.
    """
    passing, account = RecordingPass(path, TOPICS), TickAccount()
    for ticks in passing.ticks():
        account.take(ticks)
    recording = passing.recording()
    begun = account.first_t if account.count else _first_t(recording)
    records = records_of(recording, begun)
    windows = windows_of(records, recording.messages("/aircraft"), begun)
    touches = touches_of(records, windows)
    windows = counted(windows, touches)
    session = _session(recording, account, records, windows, touches, begun)
    told = (_settings(recording).get("told") or {}).get("body") or {}
    wearer = recording.settings.get("wearer") or told
    body = {name: wearer.get(name) for name in ("height_m", "mass_kg", "sex")}
    return Imported(session, windows, touches, _said(recording, records), body)


def _first_t(recording: Recording) -> float:
    times = [message["t"] for topic in TOPICS for message in recording.messages(topic)]
    return min(times, default=0.0)


def _said(recording: Recording, records: Sequence[Mapping[str, Any]]) -> StatedSession:
    options = _settings(recording).get("options") or {}
    run = _run_of(records)
    run = {**(_settings(recording).get("run") or {}), **run}
    protocol = _protocol(recording).get("name") or run.get("protocol")
    participant = run.get("participant") or options.get("participant")
    return StatedSession(participant, protocol, run.get("session") or options.get("session"))


def _run_of(records: Sequence[Mapping[str, Any]]) -> Mapping[str, Any]:
    """Return the record of the start of the run; empty without one."""
    return next((one for one in records if one["kind"] == "run_began"), {})


def _session(
    recording: Recording,
    account: TickAccount,
    records: Sequence[Mapping[str, Any]],
    windows: Sequence[Mapping[str, Any]],
    touches: Sequence[Mapping[str, Any]],
    begun: float,
) -> dict[str, Any]:
    settings, protocol, result = recording.settings, _protocol(recording), recording.last("/result")
    hashes = settings.get("hashes") or {}
    run = _run_of(records)
    pitch = run.get("pitch_mm") or (None, None)
    planned = (protocol.get("windows") or {}).get("count") or run.get("windows")
    found = totals(windows, touches)
    said = [(begun + one["t"], "paused" if one.get("by") == "interruption" else one["kind"]) for one in records]
    said += [(event["t"], "paused") for event in recording.messages("/event") if event["kind"] in WITHOUT_TICKS]
    jumps = account.jumps(said)
    end = account.last_t if account.count else max((begun + one["t"] for one in records), default=begun)
    return {
        "kind": "recording",
        "is_simulated": recording.is_simulated,
        "is_complete": _is_complete(records, found["windows_complete"], planned),
        "remark": _remark(recording, records, windows, jumps),
        "rig": settings.get("rig"),
        "side": settings.get("side"),
        "exo": protocol.get("exo"),
        "duration_s": end - begun,
        "rate_Hz": account.rate_Hz,
        "pitch_x_mm": pitch[0],
        "pitch_y_mm": pitch[1],
        "windows_planned": planned,
        **found,
        "ticks": account.count,
        "ticks_lost": max(account.lost, recording.last("/timing").get("ticks_lost") or 0),
        "clock_jumps": jumps,
        "stops": sum(event["kind"] == "stop" for event in recording.messages("/event")),
        "left_over_Nm": _left_over(result),
        "software": "; ".join(f"{name} {value}" for name, value in (settings.get("versions") or {}).items()) or None,
        "protocol_sha256": hashes.get("protocol") or run.get("protocol_sha256"),
        "calibration_sha256": hashes.get("calibration") or (result.get("calibration_used") or {}).get("hash"),
    }


def _settings(recording: Recording) -> dict[str, Any]:
    return recording.settings.get("settings") or {}


def _protocol(recording: Recording) -> dict[str, Any]:
    protocol = _settings(recording).get("protocol")
    return protocol if isinstance(protocol, dict) else {}


def _is_complete(records: Sequence[Mapping[str, Any]], complete: int, planned: int | None) -> bool:
    ended = any(one["kind"] == "run_ended" and one["is_complete"] for one in records)
    return ended or (planned is not None and complete >= planned)


def _left_over(result: Mapping[str, Any]) -> float | None:
    """Return the largest left over of a joint, from the last verification between windows.

    A predicted value is not a verification and is not used.
    """
    verified = (result.get("task") or {}).get("verified") or ()
    values = [value for value in (verified[-1]["left_over_Nm"] if verified else ()) if value is not None]
    return max(values, default=None)


def _remark(
    recording: Recording, records: Sequence[Mapping[str, Any]], windows: Sequence[Mapping[str, Any]], jumps: int
) -> str | None:
    part = (_settings(recording).get("options") or {}).get("windows")
    broken = sum(not one["is_complete"] for one in windows)
    run = _run_of(records)
    joined = _settings(recording).get("joined") or {}
    return sentences(
        # The file's name may hold another code, or the name of a person.
        (recording.remark or "").replace(recording.path.name, "The recording") or None,
        f"Joined from {joined['recordings']} recordings." if joined else None,
        *joined.get("remarks", ()),
        None if records else "The recording holds no run of a task.",
        f"Times that a clock went back or jumped ahead: {jumps}." if jumps else None,
        f"Attempts at a window that did not run to their end: {broken}." if broken else None,
        "The screen was not calibrated: there are no values in millimetres." if run and not run["pitch_mm"] else None,
        f"Only the first {part} windows were run, not the complete protocol." if part else None,
    )
