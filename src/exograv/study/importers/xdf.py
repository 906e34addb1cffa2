"""Import of XDF files of LabRecorder: our own markers, or a stream of touches of other software with a mapping.

Times are stamps after the clock synchronisation of pyxdf, which uses the offsets that LabRecorder has measured; they
are
never dejittered. Touches of our own markers take the time in the marker, which is nearer to the touch than a stamp.
"""

import contextlib
import gzip
import json
import logging
import warnings
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyxdf
from pydantic import ValidationError

from exograv.errors import RecordingError
from exograv.recording.stream_block import GAP_PERIODS
from exograv.task.records import RECORD

from .imported_session import Imported, StatedSession, counted, sentences, totals
from .task_records import touches_of, windows_of
from .touch_rows import COLUMNS, UnusableError, session_of_touches, touch_row, windows_of_touches
from .xdf_mapping import XdfMapping

OURS = "exograv-markers"
NOT_THERE = "No matching streams"
"""Part of pyxdf's message for a sound file that has other streams only."""

MARK = b"XDF:"

UNPACKED_BYTES_MAX, PIECE_BYTES = 1_000_000_000, 1 << 22
"""Largest size of an unpacked `.xdfz` file [byte], and of the pieces in which it is measured.

A file of a few megabytes can unpack to more than the memory. An hour of 64 channels at 1 kHz takes 1 GB.
"""


@dataclass(frozen=True)
class _Stream:
    name: str
    stamps: np.ndarray
    values: Sequence[Any]
    labels: tuple[str, ...]
    rate_Hz: float


def import_xdf(path: Path, mapping: XdfMapping | None = None) -> Imported:
    """Import the session of a file.

    Args:
        path: The file.
        mapping: Mapping for a file of other software; without one our own markers are read.

    Raises:
        RecordingError: The file is not XDF, lacks the stream, or the stream holds no touch that can be used.
    """
    name = OURS if mapping is None else mapping.stream
    stream, complaints = _load(path, name)
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


class _Counting(logging.Handler):
    """Log handler that counts the warnings of pyxdf. Their text is dropped, because it may hold names of streams."""

    count = 0

    def emit(self, record: logging.LogRecord) -> None:
        self.count += 1


def _load(path: Path, name: str) -> tuple[_Stream, int]:
    _refuse_too_large(path)
    counting, log = _Counting(logging.WARNING), logging.getLogger("pyxdf")
    log.addHandler(counting)
    propagates, log.propagate = log.propagate, False
    try:
        _refuse_other(path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            streams, _ = pyxdf.load_xdf(
                str(path), select_streams=[{"name": name}], dejitter_timestamps=False, synchronize_clocks=True
            )
    except ValueError as error:
        if NOT_THERE not in str(error):
            raise _unreadable(name, error) from None
        streams = []
    except Exception as error:  # noqa: BLE001  pyxdf lets whatever a damaged file provokes through
        raise _unreadable(name, error) from None
    finally:
        log.removeHandler(counting)
        log.propagate = propagates
    if len(streams) != 1 or not len(streams[0]["time_stamps"]):
        raise RecordingError(
            f"{len(streams)} streams in the file are named '{name}'; exactly one with samples is needed. Touches of "
            "another stream need a mapping (--mapping, docs/howto/study.md)."
        )
    info = streams[0]["info"]
    rate = float((info.get("nominal_srate") or ["0"])[0] or 0.0)
    stamps, values = np.array(streams[0]["time_stamps"]), list(streams[0]["time_series"])
    return _Stream(name, stamps, values, _labels(info), rate), counting.count


def _refuse_too_large(path: Path) -> None:
    """Refuse a packed file that would take the whole memory.

    Raises:
        RecordingError: The file is larger than `UNPACKED_BYTES_MAX` when it is unpacked.
    """
    if path.suffix.lower() != ".xdfz":
        return
    size = 0
    with contextlib.suppress(OSError, EOFError, zlib.error), gzip.open(path) as file:
        while size <= UNPACKED_BYTES_MAX and (piece := file.read(PIECE_BYTES)):
            size += len(piece)
    if size > UNPACKED_BYTES_MAX:
        raise RecordingError(
            f"The file holds more than {1e-9 * UNPACKED_BYTES_MAX:g} GB when it is unpacked. Save the stream of the "
            "touches without the others, and add that file."
        )


def _refuse_other(path: Path) -> None:
    """Refuse other files before pyxdf opens them: pyxdf does not close a file that it refuses."""
    with gzip.open(path) if path.suffix.lower() == ".xdfz" else path.open("rb") as file:
        if file.read(len(MARK)) != MARK:
            raise ValueError("The file does not begin with the mark of XDF.")


def _unreadable(name: str, error: Exception) -> RecordingError:
    kind = type(error).__name__
    return RecordingError(
        f"The file is not XDF with a readable stream '{name}' ({kind}). Try another copy of the file."
    )


def _labels(info: Mapping[str, Any]) -> tuple[str, ...]:
    try:
        channels = info["desc"][0]["channels"][0]["channel"]
        return tuple(str((channel.get("label") or [""])[0]) for channel in channels)
    except (KeyError, IndexError, TypeError, AttributeError):
        return ()


def _from_markers(stream: _Stream) -> Imported:
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


def _from_mapping(stream: _Stream, mapping: XdfMapping) -> Imported:
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


def _place(stream: _Stream, where: str | int) -> int:
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
