"""Figure of the sessions of all people, with their state."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from exograv.report.style.colours import GREY, INK, ORANGE, RED
from exograv.report.style.figure_style import note
from exograv.study.measures.selecting import keys, rows
from exograv.study.measures.study_data import PRIMARY, StudyData
from exograv.study.measures.table import SESSION

from .groups import WIDTH_2, marked

MARKS = {
    "whole": ("o", INK, INK),
    "something wrong": ("s", ORANGE, INK),
    "not complete": ("D", "white", RED),
    "missing": ("x", GREY, GREY),
}
"""Marker, face and edge by state; the states differ without colour too."""

MOST_ROWS = 60


def draw(data: StudyData) -> Figure | None:
    """Draw one row per person and one column per session of each protocol."""
    people = sorted(data.group_of)[:MOST_ROWS]
    columns = _columns(data)
    if not people or not columns:
        return None
    figure = Figure(figsize=(WIDTH_2, 1.0 + 0.2 * len(people)), layout="constrained")
    ax = figure.subplots()
    states = session_states(data)
    for row, code in enumerate(people):
        for at, key in columns.items():
            state = states.get((code, *key))
            if state is not None:
                marker, face, edge = MARKS[state]
                ax.plot([at], [row], marker, markerfacecolor=face, markeredgecolor=edge, markersize=5)
    ax.set_yticks(range(len(people)), people)
    ax.set_ylim(len(people) - 0.4, -0.6)
    ax.set_xticks(list(columns), [str(session) for _, session in columns.values()])
    ax.tick_params(length=0, labelsize=7)
    for protocol in dict.fromkeys(protocol for protocol, _ in columns.values()):
        own = [at for at, (name, _) in columns.items() if name == protocol]
        note(
            ax,
            protocol,
            (float(np.mean(own)), 0.0),
            (0, -18),
            xycoords=("data", "axes fraction"),
            ha="center",
            va="top",
        )
    handles = [
        Line2D([], [], marker=m, linestyle="", markerfacecolor=face, markeredgecolor=edge, label=name)
        for name, (m, face, edge) in MARKS.items()
    ]
    figure.legend(handles=handles, loc="outside upper left", ncols=len(handles))
    return marked(figure, data)


def _columns(data: StudyData) -> dict[float, tuple[str, int]]:
    """Return the position of each session on the axis, with a gap between protocols."""
    last: dict[str, int] = {one.protocol: one.sessions for one in data.settings.expected}
    for protocol, session in keys(data.tables.sessions, ["protocol", "session"]):
        last[protocol] = max(last.get(protocol, 0), session)
    found, at = dict[float, tuple[str, int]](), 0.0
    for protocol in sorted(last, key=lambda name: (name == PRIMARY, name)):
        for session in range(1, last[protocol] + 1):
            found[at] = (protocol, session)
            at += 1.0
        at += 1.2
    return found


def session_states(data: StudyData) -> dict[tuple[str, str, int], str]:
    """Return the state (key of `MARKS`) of each session that exists or is expected."""
    states = dict.fromkeys(missing_sessions(data), "missing")
    wrong = flawed(data)
    for *key, is_complete in keys(data.tables.sessions, [*SESSION, "is_complete"]):
        key = (key[0], key[1], key[2])
        states[key] = "not complete" if not is_complete else "something wrong" if key in wrong else "whole"
    return states


def missing_sessions(data: StudyData) -> list[tuple[str, str, int]]:
    """Return the expected sessions that are missing; for sealed groups only those expected of all participants."""
    there = set(keys(data.tables.sessions, SESSION))
    return [
        (code, protocol, session)
        for code in sorted(data.group_of)
        for protocol, sessions in data.settings.expected_of(None if data.is_sealed else data.group_of[code]).items()
        for session in range(1, sessions + 1)
        if (code, protocol, session) not in there
    ]


def flawed(data: StudyData) -> set[tuple[str, str, int]]:
    """Return the sessions with a remark, a clock jump, lost ticks, stops, missing windows, or without calibration."""
    s = data.tables.sessions
    is_flawed = (
        s["remark"].notna() | (s["clock_jumps"] > 0) | (s["ticks_lost"].fillna(0) > 0) | (s["stops"] > 0)
        | s["pitch_x_mm"].isna() | (s["windows_complete"] < s["windows_planned"].fillna(0))
    )  # fmt: skip
    return {(code, protocol, n) for code, protocol, n in keys(rows(s, is_flawed.astype(bool)), SESSION)}


def explain(data: StudyData) -> str:
    """Explain the figure, with the number of sessions by state."""
    states = list(session_states(data).values())
    counts = ", ".join(f"{states.count(name)} {name}" for name in MARKS if name in states)
    more = f" The first {MOST_ROWS} people are shown." if len(data.group_of) > MOST_ROWS else ""
    return f"Each mark is a session: {counts}. The table of data quality lists the problems.{more}"
