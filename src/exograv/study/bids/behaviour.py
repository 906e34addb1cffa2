"""Behaviour of the participant: one row per touch in `_beh.tsv`; touches, windows and rests in `_events.tsv`."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd

from exograv.recording import Recording
from exograv.study.folder.columns import KEY, TOUCHES, WINDOWS, Column

from .files import MISSING, write_json, write_table
from .names import SessionPlace

UNITS = {"-": None, "px": "pixel", "N·m": "N m"}
"""Units in the notation of BIDS, where it differs from ours; None for no unit."""

NO_SAMPLES = "BAD_ACQ_SKIP"
"""Kind of event with the name by which MNE leaves a part of a recording out."""

KINDS = {
    "window": "the participant may move, from the window's opening to its closing",
    "touch": "an accepted touch",
    "rejected_touch": "a rejected touch; the behaviour table gives the reason",
    "rest": "the hand rests, at the full weight of 1 g",
    "ramp": "the felt weight changes; the participant is not asked to move",
    "hold": "the felt weight is that of the next window; the participant is not asked to move",
    "hyper": "the pull-up of the aircraft",
    "paused": "the run is paused",
    "resumed": "the run continues",
    "alarm_raised": "an alarm for the operator",
    "stop": "the guard or a person stopped the machine",
    "run_began": "the protocol begins",
    "run_ended": "the protocol ends",
    NO_SAMPLES: "the device sent no samples: the values of its file are interpolated here",
}
"""Values of `trial_type`. Sentences of a recording are not exported, because an operator may have typed them."""

PHASES = ("rest", "ramp", "hold", "hyper")
SAID = ("paused", "resumed", "alarm_raised", "run_began", "run_ended")

EVENTS: dict[str, dict[str, Any]] = {
    "onset": {
        "Description": "beginning of the event, since the first row of the recording with the same name",
        "Units": "s",
    },
    "duration": {"Description": "duration of the event; 0 for an instantaneous event", "Units": "s"},
    "trial_type": {"Description": "kind of the event", "Levels": KINDS},
    "window": {"Description": "number of the window of the event, from 1"},
    "attempt": {"Description": "number of the attempt at the window, from 1; more than 1 after an interrupted attempt"},
    "gravity_level": {
        "Description": "felt share of the arm's weight: 0 weightless, 1 Earth; for a ramp, the value at its end"
    },
    "page": {"Description": "for a touch: page that sent the touch, as in the behaviour table"},
    "sequence": {"Description": "for a touch: its number in the behaviour table"},
    "marks": {"Description": "for a window: special events in the window"},
}

Row = Mapping[str, Any]


def own_columns(columns: Sequence[Column]) -> list[Column]:
    """Return the columns of one session's table, without the key."""
    return [column for column in columns if column not in KEY]


def file_name(column: Column) -> str:
    """Return the name of a column in the data set."""
    return column.name.removeprefix("is_")


def described(columns: Sequence[Column]) -> dict[str, Any]:
    """Return the descriptions of a table's columns, for its sidecar file."""
    found = dict[str, Any]()
    for column in columns:
        unit = UNITS.get(column.unit, column.unit)
        levels = {"Levels": {"true": "yes", "false": "no"}} if column.kind == "bool" else {}
        found[file_name(column)] = {"Description": column.meaning, **({"Units": unit} if unit else {}), **levels}
    return found


def rows_of(table: pd.DataFrame, columns: Sequence[Column]) -> list[dict[str, Any]]:
    """Return a table's rows with the data set's column names; NA is None."""
    by_name: dict[str, list[Any]] = table.to_dict("list")
    values = {file_name(column): [_none_if_missing(one) for one in by_name[column.name]] for column in columns}
    return [dict(zip(values, row, strict=True)) for row in zip(*values.values(), strict=True)]


def _none_if_missing(value: Any) -> Any:
    return None if pd.isna(value) else value


def write_behaviour(root: Path, place: SessionPlace, touches: pd.DataFrame, about: Row) -> None:
    """Write all touches of a session, in the order of time."""
    columns = own_columns(TOUCHES)
    rows = rows_of(touches.sort_values(["t_s", "page", "sequence"], kind="stable"), columns)
    write_table(root / place.behaviour("beh.tsv"), [file_name(column) for column in columns], rows)
    write_json(root / place.behaviour("beh.json"), {**about, **described(columns)})


def events_of(
    windows: pd.DataFrame, touches: pd.DataFrame, recording: tuple[Recording, float] | None = None
) -> list[dict[str, Any]]:
    """Return the events of a session, in the order of time.

    Args:
        windows: Windows of the session.
        touches: Touches of the session.
        recording: Recording with the messages of `/task` and `/event`, and the beginning of its motion on the rig's
        clock
            [s]. Without a recording, rests, pauses and stops are not known.
    """
    rows = [*_windows(windows), *_touches(touches), *(_told(*recording) if recording else ())]
    return sorted(rows, key=lambda row: (row["onset"], list(KINDS).index(row["trial_type"]), row.get("sequence") or 0))


def write_events(path: Path, events: Sequence[Row], later_s: float, about: Row) -> None:
    """Write the events beside the recording to which they belong.

    Args:
        path: Path of the table.
        events: Events as `events_of` returns them.
        later_s: Delay of that recording after the motion of the exoskeleton [s].
        about: Content that all sidecars of the session share.
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
