"""What the participant did: one row a touch in `_beh.tsv`, and with windows and rests in `_events.tsv`."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from exograv.recording import Recording
from exograv.study.folder.columns import KEY, TOUCHES, WINDOWS, Column

from .files import MISSING, write_json, write_table
from .names import SessionPlace

UNITS = {"-": None, "px": "pixel", "N·m": "N m"}
"""By the words of BIDS, where they are others than ours; None where there is none."""

KINDS = {
    "window": "the participant may move, from its opening to its closing",
    "touch": "a touch that counts",
    "rejected_touch": "a touch that does not count; why stands in the behaviour's table",
    "rest": "the hand rests, at the weight of 1 g",
    "ramp": "the weight that is felt changes; no movement is asked for",
    "hold": "the weight of the next window is there; no movement is asked for",
    "hyper": "the pull-up of the aircraft",
    "paused": "the run stands",
    "resumed": "the run goes on",
    "alarm_raised": "the operator has to know something",
    "stop": "the guard, or somebody, stopped the machine",
    "run_began": "the protocol begins",
    "run_ended": "the protocol ends",
}
"""What may stand in `trial_type`. Sentences of a recording are not exported: an operator may have typed them."""

PHASES = ("rest", "ramp", "hold", "hyper")
SAID = ("paused", "resumed", "alarm_raised", "run_began", "run_ended")

EVENTS: dict[str, dict[str, Any]] = {
    "onset": {"Description": "when it began, since the first row of the recording of this name", "Units": "s"},
    "duration": {"Description": "how long it took; 0 for what takes no time", "Units": "s"},
    "trial_type": {"Description": "what it is", "Levels": KINDS},
    "window": {"Description": "in which it fell, from 1"},
    "attempt": {"Description": "at the window, from 1; more where it was broken off"},
    "gravity_level": {"Description": "felt share of the arm's weight: 0 weightless, 1 Earth; of a ramp where it ends"},
    "page": {"Description": "of a touch: which page sent it, as in the behaviour's table"},
    "sequence": {"Description": "of a touch: its number there"},
    "marks": {"Description": "of a window: what is special about it"},
}

Row = Mapping[str, Any]


def own_columns(columns: Sequence[Column]) -> list[Column]:
    """Those of one session's table, without the key."""
    return [column for column in columns if column not in KEY]


def file_name(column: Column) -> str:
    """How a column is called in the data set."""
    return column.name.removeprefix("is_")


def described(columns: Sequence[Column]) -> dict[str, Any]:
    """A table's sidecar."""
    found = dict[str, Any]()
    for column in columns:
        unit = UNITS.get(column.unit, column.unit)
        levels = {"Levels": {"true": "yes", "false": "no"}} if column.kind == "bool" else {}
        found[file_name(column)] = {"Description": column.meaning, **({"Units": unit} if unit else {}), **levels}
    return found


def rows_of(table: pd.DataFrame, columns: Sequence[Column]) -> list[dict[str, Any]]:
    """A table's rows by the names in the data set; NA is None."""
    by_name: dict[str, list[Any]] = table.to_dict("list")
    values = {file_name(column): [_none_if_missing(one) for one in by_name[column.name]] for column in columns}
    return [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]


def _none_if_missing(value: Any) -> Any:
    return None if pd.isna(value) else value


def write_behaviour(root: Path, place: SessionPlace, touches: pd.DataFrame, about: Row) -> None:
    """All touches of a session, in their order of time."""
    columns = own_columns(TOUCHES)
    rows = rows_of(touches.sort_values(["t_s", "page", "sequence"], kind="stable"), columns)
    write_table(root / place.behaviour("beh.tsv"), [file_name(column) for column in columns], rows)
    write_json(root / place.behaviour("beh.json"), {**about, **described(columns)})


def events_of(
    windows: pd.DataFrame, touches: pd.DataFrame, recording: tuple[Recording, float] | None = None
) -> list[dict[str, Any]]:
    """What happened, in the order of time.

    Args:
        windows: Of the session.
        touches: Of the session.
        recording: With the messages of `/task` and `/event`, and when its motion begins on the rig's clock [s]. Without
            it, rests, pauses and stops are not known.
    """
    rows = [*_windows(windows), *_touches(touches), *(_told(*recording) if recording else ())]
    return sorted(rows, key=lambda row: (row["onset"], list(KINDS).index(row["trial_type"]), row.get("sequence") or 0))


def write_events(path: Path, events: Sequence[Row], later_s: float, about: Row) -> None:
    """Write them beside the recording to which they belong.

    Args:
        path: Of the table.
        events: By `events_of`.
        later_s: By which that recording begins after the motion of the exoskeleton [s].
        about: What every sidecar of the session says.
    """
    rows = [{**event, "onset": event["onset"] - later_s} for event in events]
    write_table(path, list(EVENTS), rows)
    screen = {"SoftwareName": "exograv", "SoftwareVersion": about.get("SoftwareVersions") or MISSING}
    write_json(path.with_suffix(".json"), {**about, **EVENTS, "StimulusPresentation": screen})


def _windows(windows: pd.DataFrame) -> Iterator[dict[str, Any]]:
    for row in rows_of(windows, own_columns(WINDOWS)):
        closed = row["closed_s"]
        duration = None if closed is None else closed - row["opened_s"]
        kept = {name: row[name] for name in ("window", "attempt", "gravity_level")}
        marks = row["marks"] or None
        yield {"onset": row["opened_s"], "duration": duration, "trial_type": "window", **kept, "marks": marks}


def _touches(touches: pd.DataFrame) -> Iterator[dict[str, Any]]:
    for row in rows_of(touches, own_columns(TOUCHES)):
        kept = {name: row[name] for name in ("window", "attempt", "gravity_level", "page", "sequence")}
        kind = "touch" if row["accepted"] else "rejected_touch"
        yield {"onset": row["t_s"], "duration": 0.0, "trial_type": kind, **kept}


def _told(recording: Recording, first_t: float) -> Iterator[dict[str, Any]]:
    for message in recording.messages("/task"):
        record, onset = message["record"], message["t"] - first_t
        if message["kind"] == "phase_began" and record["phase"] in PHASES:
            level, kind = record["gravity_level_end"], record["phase"]
            duration, window = record["duration_s"], record["window"]
            yield {"onset": onset, "duration": duration, "trial_type": kind, "window": window, "gravity_level": level}
        elif message["kind"] in SAID:
            yield {"onset": onset, "duration": 0.0, "trial_type": message["kind"]}
    for event in recording.messages("/event"):
        if event["kind"] == "stop":
            yield {"onset": event["t"] - first_t, "duration": 0.0, "trial_type": "stop"}
