"""Rows of windows and touches from the task's records, in a recording or in LSL markers."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from exograv.recording import Recording
from exograv.study.folder.columns import TOUCHES
from exograv.task.record_sinks import TASK_TOPIC
from exograv.task.records import TouchRecord

SENT_AGAIN = "repeated"
"""Reason of a touch that the page sent twice. The second record is a duplicate and gives no row."""

TOUCH = tuple(column.name for column in TOUCHES if column.name in TouchRecord.model_fields)
"""Fields of a touch's record that the table has too."""


def records_of(recording: Recording, begun: float = 0.0) -> list[dict[str, Any]]:
    """Return the records of the task in a recording, with `t` on the rig's clock, counted from `begun` [s].

    At a console, the time in a record is the computer's and the time of its message is the rig's.
    """
    return [{**message["record"], "t": message["t"] - begun} for message in recording.messages(TASK_TOPIC)]


def windows_of(
    records: Sequence[Mapping[str, Any]], aircraft: Sequence[Mapping[str, Any]] = (), begun: float = 0.0
) -> list[dict[str, Any]]:
    """Return rows of `WINDOWS`, one per attempt, without key and counts.

    Args:
        records: Records in their order; `t` counts from the beginning of the recording.
        aircraft: Messages of `/aircraft`, on the rig's clock.
        begun: Beginning of the recording on that clock [s].
    """
    closed = {(one["window"], one["attempt"]): one for one in records if one["kind"] == "window_closed"}
    t = np.array([sample["t"] for sample in aircraft]) - begun
    g = np.array([np.linalg.norm(sample["g"]) for sample in aircraft])
    rows = list[dict[str, Any]]()
    for one in records:
        if one["kind"] != "window_opened":
            continue
        end = closed.get((one["window"], one["attempt"]), {})
        inside = (t >= one["t"]) & (t < end.get("t", np.inf))
        rows.append(
            {
                "window": one["window"],
                "attempt": one["attempt"],
                "opened_s": one["t"],
                "closed_s": end.get("t"),
                "opened_by": one["by"],
                "closed_by": end.get("by"),
                "is_complete": bool(end.get("is_complete", False)),
                "marks": ";".join(end.get("marks", ())),
                "gravity_level": one["gravity_level"],
                "g_median": float(np.median(g[inside])) if inside.any() else None,
            }
        )
    return rows


def touches_of(records: Sequence[Mapping[str, Any]], windows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return rows of `TOUCHES`, without key."""
    levels = {(one["window"], one["attempt"]): one["gravity_level"] for one in windows}
    return [
        {
            **{name: one[name] for name in TOUCH},
            "t_s": one["t"],
            "contact_px": one["contact_px"] or None,
            "gravity_level": levels.get((one["window"], one["attempt"])),
        }
        for one in records
        if one["kind"] == "touch" and one["reason"] != SENT_AGAIN
    ]
