"""Tables of the report as text, so that a reader can copy them. A table without rows has no chapter."""

import json
import re
from collections.abc import Sequence
from typing import Any

from markupsafe import Markup, escape

from exograv.recording import Recording
from exograv.recording.fields import Message
from exograv.report.style.figure_style import joint_label
from exograv.report.style.page import Block, Chapter, Folded, Table, Text

FOLDED_FROM = 150
"""Number of characters above which a setting is folded."""


def parameter_table(recording: Recording) -> Chapter | None:
    """Return estimates of the arm, with the values of the body table and the twin's truth."""
    entries = recording.last("/result").get("parameters") or recording.last("/estimate").get("parameters") or []
    note = (
        "The true value lies in the interval with 95 % certainty; only the twin knows it. mx, my, mz are mass times "
        "the coordinates of the centre of mass from the joint, I… moments of inertia about the joint."
    )
    rows = [
        (
            _words(e["name"]),
            e.get("unit", ""),
            *(_number(e.get(k)) for k in ("prior", "estimate")),
            _interval(e),
            _number(e.get("truth")),
        )
        for e in entries
    ]
    return _chapter(
        "The arm in numbers", note, ("property", "unit", "body table", "estimate", "95 % interval", "truth"), rows
    )


def calibration_table(recording: Recording) -> Chapter | None:
    """Return estimates of the empty machine (stage 0): one row per joint, one column per quantity."""
    entries = recording.last("/result").get("calibration") or []
    found = {(entry["joint"], entry["name"]): entry for entry in entries}
    joints, names = dict.fromkeys(e["joint"] for e in entries), dict.fromkeys(e["name"] for e in entries)
    units = {entry["name"]: entry["unit"] for entry in entries}
    note = (
        "Measured before the person stepped in, by slow sweeps in both directions and with known weights. Gain: torque "
        "per motor current. Coulomb: friction at any speed. Viscous: friction that grows with speed. In brackets: the "
        "95 % interval."
    )
    rows = [(joint_label(joint), *(_calibrated(found.get((joint, name))) for name in names)) for joint in joints]
    return _chapter("The empty machine", note, ("joint", *(f"{_words(name)} [{units[name]}]" for name in names)), rows)


def _calibrated(entry: dict[str, Any] | None) -> str:
    if entry is None:
        return ""
    interval = f" ({_interval(entry)})" if entry.get("ci95") else ""
    truth = f", truth {_number(entry['truth'])}" if entry.get("truth") is not None else ""
    return _number(entry["estimate"]) + interval + truth


def event_table(recording: Recording) -> Chapter | None:
    """Return phases and events, in order of time."""
    rows = [(p["t"], "phase", _words(p["name"])) for p in recording.messages("/phase")]
    rows += [(e["t"], e["kind"], e["text"]) for e in recording.messages("/event")]
    rows.sort(key=lambda row: row[0])
    lines = [(f"{t:.2f}", kind, text) for t, kind, text in rows]
    return _chapter("Events", "", ("time [s]", "kind", "what"), lines)


def settings_table(recording: Recording) -> Chapter | None:
    """Return all settings that are needed to repeat the run; files and long lists are folded."""
    settings = [(name, value, _plain(value)) for name, value in _flat(recording.settings)]
    rows = [(_breakable(name), text) for name, _, text in settings if len(text) <= FOLDED_FROM]
    folded = [Folded(*_file(name, value)) for name, value, text in settings if len(text) > FOLDED_FROM]
    note = "With these settings and the same version of the software, the run can be repeated exactly."
    return _chapter("Settings", note, ("name", "value"), rows, folded)


def _breakable(name: str) -> Markup:
    """Return a name that a narrow page breaks after a dot or an underscore, not within a word."""
    return Markup(re.sub(r"(?<=[._])(?=\w)", "<wbr>", str(escape(name))))


def _file(name: str, value: Any) -> tuple[str, str]:
    """Return title and lines of a long setting."""
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False, indent=1)
    lines = text.count("\n") + 1
    return f"{name} ({lines} lines)", text


def _chapter(
    title: str, note: str, columns: Sequence[str], rows: Sequence[Sequence[str]], more: Sequence[Block] = ()
) -> Chapter | None:
    return Chapter(title, [*([Text(note)] if note else []), Table(columns, rows), *more]) if rows else None


def _flat(value: Message, prefix: str = "") -> list[tuple[str, Any]]:
    rows: list[tuple[str, Any]] = []
    for name, inner in value.items():
        rows += _flat(inner, f"{prefix}{name}.") if isinstance(inner, dict) else [(f"{prefix}{name}", inner)]
    return rows


def _plain(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)


def _words(name: str) -> str:
    return name.replace("_", " ").replace(".", ": ")


def _number(value: float | int | None) -> str:
    return "" if value is None else f"{value:.4g}".replace("-", "−")


def _interval(entry: dict[str, Any]) -> str:
    interval = entry.get("ci95")
    return f"{_number(interval[0])}…{_number(interval[1])}" if interval else ""
