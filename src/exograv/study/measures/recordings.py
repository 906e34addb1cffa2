"""Measures from a recording: reaches of hand and joints, share of the arm's weight that was carried, traces."""

from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.recording import Recording, read_topics, tick_pieces
from exograv.study.importers.task_records import records_of

from .reaches import MeasuredReach, Motion, reaches, scatter_about_mean
from .table import Row, rows_of
from .traces import MARGIN_S, WindowTrace, flown_levels, trace_rows, window_trace

KEPT = ("t", "gravity_level", "arm_share", "q_measured", "tau_measured")
"""Fields of a tick that are held for the length of a window."""


@dataclass(frozen=True)
class Window:
    """Complete window of a session. Times are on the clock of the recording."""

    window: int
    attempt: int
    opened_s: float
    closed_s: float
    touches: tuple[dict[str, Any], ...]
    """Records of the accepted touches, in order of time."""


def complete_windows(recording: Recording) -> list[Window]:
    """Return the complete windows of a session with a task; of a repeated window, the last complete attempt."""
    opened = dict[tuple[int, int], float]()
    touches = defaultdict[tuple[int, int], list[dict[str, Any]]](list)
    windows = dict[int, tuple[tuple[int, int], float]]()
    for record in records_of(recording):
        key = (record.get("window") or 0, record.get("attempt") or 0)
        if record["kind"] == "window_opened":
            opened[key] = record["t"]
        elif record["kind"] == "touch" and record["is_accepted"]:
            touches[key].append(record)
        elif record["kind"] == "window_closed" and record["is_complete"] and key in opened:
            windows[key[0]] = (key, record["t"])
    in_order = {key: tuple(sorted(found, key=lambda touch: touch["t"])) for key, found in touches.items()}
    return [Window(key[0], key[1], opened[key], closed, in_order.get(key, ())) for key, closed in windows.values()]


def windowed(
    pieces: Iterable[np.ndarray], windows: Iterable[Window], margin_s: float = 0.0
) -> Iterator[tuple[Window, np.ndarray]]:
    """Yield each window with its ticks and those of a margin around it, fields `KEPT` only.

    At most one window's ticks and one piece are in memory. Margins must not overlap.
    """
    waiting = sorted(windows, key=lambda window: window.opened_s, reverse=True)
    held: list[np.ndarray] = []
    for piece in pieces:
        while waiting and len(piece):
            window = waiting[-1]
            last_s = window.closed_s + margin_s
            is_in = (piece["t"] >= window.opened_s - margin_s) & (piece["t"] <= last_s)
            if is_in.any():
                held.append(_narrowed(piece[is_in]))
            if piece["t"][-1] <= last_s:
                break
            waiting.pop()
            if held:
                yield window, np.concatenate(held)
            held = []
    if waiting and held:
        yield waiting[-1], np.concatenate(held)


def _narrowed(ticks: np.ndarray) -> np.ndarray:
    narrow = np.empty(len(ticks), [(name, ticks.dtype[name]) for name in KEPT])
    for name in KEPT:
        narrow[name] = ticks[name]
    return narrow


@dataclass(frozen=True)
class RecordedMeasures:
    """Measures from the recording of one session."""

    rows: list[Row]
    """Rows of the table of measures."""

    trace: list[Row]
    """Rows of the table of traces (`traces.TRACES`)."""

    unpublished: tuple[str, ...]
    """Names of values in the session's protocol that are the experimenter's choice and not the paper's."""


def read_measures(path: Path, key: dict[str, Any]) -> RecordedMeasures:
    """Read the measures of a recording in two passes: one for the messages, one for the ticks.

    Args:
        path: The recording.
        key: Participant, protocol and session.

    Raises:
        RecordingError: The recording cannot be read.
    """
    recording = read_topics(path, ("/task", "/skeleton", "/aircraft"))
    windows = complete_windows(recording)
    hand = hand_motion(recording)
    rows = list[Row]()
    if hand is not None:
        for window in windows:
            rows += _reach_rows(key, window, list(_reaches(hand, window)), "hand")
    courses: list[np.ndarray] = []
    traces: list[WindowTrace] = []
    for window, ticks in windowed(tick_pieces(path), windows, MARGIN_S):
        traces.append(window_trace(window.opened_s, ticks["t"], ticks["q_measured"], ticks["gravity_level"]))
        inside = ticks[(ticks["t"] >= window.opened_s) & (ticks["t"] <= window.closed_s)]
        if len(inside):
            found = list(_reaches(Motion(inside["t"], inside["q_measured"]), window))
            courses += [reach.course for reach in found if reach is not None]
            rows += _reach_rows(key, window, found, "joint")
            place = {"window": window.window, "attempt": window.attempt}
            rows += rows_of("window", {**key, **place}, effort(inside))
    if courses:
        end, course = np.rad2deg(scatter_about_mean(np.array(courses)))
        rows += rows_of("session", key, {"end_posture_scatter_deg": end, "path_scatter_deg": course})
    flown = flown_levels(recording.messages("/aircraft"), [window.opened_s for window in windows])
    protocol = (recording.settings.get("settings") or {}).get("protocol") or {}
    return RecordedMeasures(rows, trace_rows(key, traces, flown), tuple(protocol.get("unpublished") or ()))


def hand_motion(recording: Recording) -> Motion | None:
    """Motion of the end of the arm's skeleton, about 20 times a second; None if the recording has no skeleton."""
    points = [(m["t"], m["arm"][-1]) for m in recording.messages("/skeleton") if len(m["arm"])]
    return Motion(np.array([t for t, _ in points]), np.array([p for _, p in points], float)) if points else None


def _reaches(motion: Motion, window: Window) -> Iterator[MeasuredReach | None]:
    return reaches(motion, window.opened_s, [touch["t"] for touch in window.touches])


def effort(ticks: np.ndarray) -> dict[str, float]:
    """Compute the RMS motor torque in a window, and the mean share of the arm's weight that the machine carried.

    The share is NaN if the recording does not state it.
    """
    carried: Float[np.ndarray, " tick"] = (1.0 - ticks["gravity_level"]) * ticks["arm_share"]
    known = carried[np.isfinite(carried)]
    return {
        "motor_torque_rms_Nm": float(np.sqrt(np.mean(ticks["tau_measured"].astype(float) ** 2))),
        "carried_share": float(known.mean()) if len(known) else np.nan,
    }


def _reach_rows(key: dict[str, Any], window: Window, found: list[MeasuredReach | None], which: str) -> Iterator[Row]:
    for touch, reach in zip(window.touches, found, strict=True):
        if reach is None:
            continue
        if which == "hand":
            values = {"path_m": reach.length, "peak_speed_m_per_s": reach.peak_speed}
        else:
            values = {"path_rad": reach.length, "peak_speed_rad_per_s": reach.peak_speed, "ldlj": reach.ldlj}
        values = {"movement_s": reach.movement_s, "sparc": reach.sparc, **values}
        place = {"window": window.window, "attempt": window.attempt}
        place |= {"sequence": touch["sequence"], "page": touch["page"]}
        yield from rows_of("touch", {**key, **place}, {f"{which}_{name}": value for name, value in values.items()})
