"""Import of XDF files of LabRecorder: our own markers, or a stream of touches of other software with a mapping.

Times are stamps after the clock synchronisation of pyxdf, which uses the offsets that LabRecorder has measured; they
are
never dejittered. Touches of our own markers take the time in the marker, which is nearer to the touch than a stamp.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from exograv.errors import RecordingError
from exograv.recording.stream_block import GAP_PERIODS
from exograv.task.records import RECORD

from .imported_session import Imported, StatedSession, counted, sentences, totals
from .task_records import touches_of, windows_of
from .touch_rows import COLUMNS, UnusableError, session_of_touches, touch_row, windows_of_touches
from .xdf_mapping import XdfMapping
from .xdf_stream import XdfStream, load_stream

OURS = "exograv-markers"
OTHERWISE = "Touches of another stream need a mapping (--mapping, docs/howto/study.md)."


def import_xdf(path: Path, mapping: XdfMapping | None = None) -> Imported:
    """Import the session of a file.

    Args:
        path: The file.
        mapping: Mapping for a file of other software; without one our own markers are read.

    Raises:
        RecordingError: The file is not XDF, lacks the stream, or the stream holds no touch that can be used.
    """
    name = OURS if mapping is None else mapping.stream
    stream, complaints = load_stream(path, name, OTHERWISE)
    found = _from_markers(stream) if mapping is None else _from_mapping(stream, mapping)
    back = int(np.count_nonzero(np.diff(stream.stamps) < 0.0))
    gaps = int(np.count_nonzero(np.diff(stream.stamps) * stream.rate_Hz > GAP_PERIODS)) if stream.rate_Hz else 0
    session = {
        **found.session,
        "clock_jumps": back,
        "remark": sentences(
            found.session.get("remark"),
            f"Warnings of the file's reader about damaged places or clocks that were reset: {complaints}."
            if complaints
            else None,
            f"Times that stamps went back: {back}." if back else None,
            f"Gaps between samples: {gaps}." if gaps else None,
            f"Samples that were refused: {len(found.refusals)}." if found.refusals else None,
        ),
    }
    return Imported(session, found.windows, found.touches, found.said, found.body, found.refusals)


def _from_markers(stream: XdfStream) -> Imported:
    records, refusals = list[dict[str, Any]](), list[str]()
    for number, sample in enumerate(stream.values):
        text = str(sample[0])
        if not text.startswith("{"):
            continue  # a message of a live run, not a record of a task
        try:
            records.append(RECORD.validate_json(text).model_dump(mode="json"))
        except ValidationError:
            refusals.append(f"sample {number}: not a record of a task")
    if not records:
        raise RecordingError(f"Stream '{stream.name}' holds no record of a task: no task ran during the recording.")
    begun = min(one["t"] for one in records)
    records = [{**one, "t": one["t"] - begun} for one in records]
    windows = windows_of(records)
    touches = touches_of(records, windows)
    windows = counted(windows, touches)
    run = next((one for one in records if one["kind"] == "run_began"), {})
    pitch = run.get("pitch_mm") or (None, None)
    session = {
        "kind": "xdf",
        "is_simulated": any(str(one["page"]).startswith("simulated") for one in touches),
        "is_complete": any(one["kind"] == "run_ended" and one["is_complete"] for one in records),
        "remark": "The screen was not calibrated: there are no values in millimetres." if pitch[0] is None else None,
        "duration_s": max(one["t"] for one in records),
        "pitch_x_mm": pitch[0],
        "pitch_y_mm": pitch[1],
        **totals(windows, touches),
        "ticks": 0,
        "stops": 0,
        "protocol_sha256": run.get("protocol_sha256"),
    }
    return Imported(session, windows, touches, StatedSession(protocol=run.get("protocol")), refusals=refusals)


def _from_mapping(stream: XdfStream, mapping: XdfMapping) -> Imported:
    places = {column: _place(stream, where) for column, where in mapping.columns.items()}
    if unknown := [name for name in (*places, *mapping.fixed) if name not in COLUMNS or name == "t_s"]:
        raise RecordingError(f"The mapping names {', '.join(unknown)}; allowed are {', '.join(COLUMNS)}, except t_s.")
    fixed = {
        name: json.dumps(value) if isinstance(value, bool) else str(value) for name, value in mapping.fixed.items()
    }
    touches, refusals = list[dict[str, Any]](), list[str]()
    first = float(stream.stamps[0])
    for number, (stamp, sample) in enumerate(zip(stream.stamps, stream.values, strict=True)):
        cells = {
            **fixed,
            **{column: str(sample[place]) for column, place in places.items()},
            "t_s": repr(float(stamp - first)),
        }
        try:
            row = touch_row(cells, _number, number)
            if row["gravity_level"] is None:
                raise UnusableError("gravity_level is missing")
        except UnusableError as error:
            refusals.append(f"sample {number}: {error}")
            continue
        touches.append(row)
    if not touches:
        raise RecordingError(f"No sample of stream '{stream.name}' can be used. {'; '.join(refusals[:3])}.")
    windows = windows_of_touches(touches)
    return Imported(session_of_touches("xdf", windows, touches), windows, touches, refusals=refusals)


def _place(stream: XdfStream, where: str | int) -> int:
    channels = len(stream.values[0])
    if isinstance(where, str) and where in stream.labels:
        return stream.labels.index(where)
    if isinstance(where, int) and where < channels:
        return where
    raise RecordingError(
        f"The mapping names a channel that stream '{stream.name}' does not have. Its {channels} channels are labelled "
        f"{', '.join(stream.labels) or '(none)'}. Correct the mapping."
    )


def _number(cell: str) -> float | None:
    try:
        return float(cell)
    except ValueError:
        return None
