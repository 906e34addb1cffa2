"""Streams of other devices as `_physio.tsv.gz`: values as received, on the robot's clock, gaps as rows of n/a.

What has no rate of its own, is text, or has no place in the robot's time is not exported: it stays in the recording.
"""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from gzip import GzipFile
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from exograv.recording import Recording
from exograv.recording.device_stream import DeviceStream, joined, rig_time
from exograv.recording.stream_block import StreamBlock
from exograv.study.sync import GAP_PERIODS

from .files import MISSING, number_rows, packed, write_json
from .names import EXO, SessionPlace, label

FILL_MAX_S = 3600.0
"""A longer gap is a clock that leapt: no rows for it."""

TIME_DECIMALS, VALUE_DECIMALS = 6, 9
LATENCY = "latency"


@dataclass(frozen=True)
class Left:
    """A stream that is not exported. Its name is not repeated: somebody has typed it."""

    kind: str
    why: str


def device_streams(recording: Recording) -> tuple[list[DeviceStream], list[Left]]:
    """Streams of a recording that have a rate and a place in the robot's time, still without samples; and the others.

    Args:
        recording: With the messages of `/stream` and `/correction`, and ticks that have both clocks.
    """
    notes, corrections = recording.messages("/stream"), recording.messages("/correction")
    streams, left = list[DeviceStream](), list[Left]()
    for topic in dict.fromkeys(note["topic"] for note in notes):
        stream = joined(topic, "", (), notes, corrections, recording.ticks)
        why = _why_not(stream)
        if why is None:
            streams.append(stream)
        else:
            left.append(Left(stream.kind, why))
    return streams, left


def _why_not(stream: DeviceStream) -> str | None:
    if stream.description.findtext("channel_format") == "string":
        return "it is text"
    if not stream.nominal_rate_Hz:
        return "it has no rate of its own"
    if not stream.clocks:
        return "nothing was measured of its clock"
    if not np.isfinite(stream.ticks["monotonic"]).any():
        return "the robot's clock is not tied to the computer's"
    return None


class Devices:
    """The files of a session's streams while they are written. `with Devices(...) as devices:` closes them."""

    def __init__(self, root: Path, place: SessionPlace, recording: Recording, first_t: float):
        """Nothing is written yet.

        Args:
            root: Of the data set.
            place: Of the session.
            recording: As `device_streams` takes it.
            first_t: When its motion begins [s].
        """
        self._streams, self.left = device_streams(recording)
        self._root, self._place, self._first_t = root, place, first_t
        self._stack = ExitStack()
        self._writers = dict[str, _Physio]()

    def __enter__(self) -> "Devices":
        short = _unique([label(stream.kind) or "device" for stream in self._streams], len(self._streams))
        for stream, name in zip(self._streams, short, strict=True):
            table = self._place.motion(EXO, f"recording-{name}_physio.tsv.gz")
            file = self._stack.enter_context(packed(self._root / table))
            self._writers[stream.topic] = _Physio(stream, table, file, self._first_t)
        return self

    def __exit__(self, *_error: object) -> None:
        self._stack.close()

    def take(self, topic: str, block: StreamBlock) -> None:
        """Some samples."""
        if topic in self._writers:
            self._writers[topic].take(block)

    def finish(self, about: Mapping[str, Any]) -> dict[PurePosixPath, float]:
        """Write the sidecars; streams without a sample leave nothing.

        Returns:
            When each file begins after the motion [s], by its path from the root.
        """
        self._stack.close()
        found = dict[PurePosixPath, float]()
        for writer in self._writers.values():
            path = self._root / writer.table
            if writer.first is None:
                path.unlink()
                self.left.append(Left(writer.stream.kind, "it sent nothing"))
            else:
                write_json(path.with_name(path.name.replace(".tsv.gz", ".json")), {**about, **writer.sidecar()})
                found[writer.table] = writer.starts_s
        return found


class _Physio:
    """One stream."""

    def __init__(self, stream: DeviceStream, table: PurePosixPath, file: GzipFile, first_t: float):
        self.stream, self.table = stream, table
        self.first: float | None = None
        self._file, self._begin = file, first_t
        self._last = -np.inf
        self._missing = self._dropped = self._steady = self._samples = 0
        self._steady_s = 0.0

    @property
    def starts_s(self) -> float:
        """After the motion [s]."""
        return 0.0 if self.first is None else self.first - self._begin

    def take(self, block: StreamBlock) -> None:
        """Write its samples. Those whose connection has no clock, or that are not later than others, are counted."""
        fit = self.stream.clocks.get(block.connection)
        if fit is None:
            self._dropped += len(block.stamps)
            return
        t = rig_time(self.stream.ticks, block.stamps + fit.correction(block.stamps))
        is_later = t > np.maximum.accumulate(np.concatenate([[self._last], t[:-1]]))
        self._dropped += int(np.count_nonzero(~is_later))
        t, values = t[is_later], np.asarray(block.values, float)[is_later]
        if not len(t):
            return
        if self.first is None:
            self.first = self._last = float(t[0])
        self._samples += len(t)
        self._write(t, values)
        self._last = float(t[-1])

    def _write(self, t: np.ndarray, values: np.ndarray) -> None:
        rate = self.stream.nominal_rate_Hz
        elapsed = np.diff(t, prepend=self._last)
        is_gap = elapsed * rate > GAP_PERIODS
        steady = ~is_gap & (elapsed > 0.0)
        self._steady += int(np.count_nonzero(steady))
        self._steady_s += float(elapsed[steady].sum())
        missing = np.where(is_gap & (elapsed < FILL_MAX_S), np.round(elapsed * rate) - 1, 0).astype(int)
        self._missing += int(missing.sum())
        rows = np.arange(len(t)) + np.cumsum(missing)
        table = np.full((len(t) + int(missing.sum()), values.shape[1] + 1), np.nan)
        table[rows, 0], table[rows, 1:] = t, values
        # Rows for what is missing lie evenly between their neighbours.
        known = np.concatenate([[-1], rows])
        table[:, 0] = np.interp(np.arange(len(table)), known, np.concatenate([[self._last], t]))
        table[:, 0] -= self.first or 0.0
        self._file.write(number_rows(list(table.T), [TIME_DECIMALS] + [VALUE_DECIMALS] * values.shape[1]))

    def sidecar(self) -> dict[str, Any]:
        """What is in the file."""
        stream = self.stream
        names = _unique([label(text) or "channel" for text in stream.labels][: stream.channels], stream.channels)
        units = [one.findtext("unit") for one in stream.description.iterfind("desc/channels/channel")]
        units = [*units, *[None] * len(names)]
        columns = {
            name: {"Description": f"channel {k}, as received", **({"Units": unit} if unit else {})}
            for k, (name, unit) in enumerate(zip(names, units, strict=False), start=1)
        }
        effective = self._steady / self._steady_s if self._steady_s > 0.0 else None
        return {
            "SamplingFrequency": stream.nominal_rate_Hz,
            "SamplingFrequencyEffective": MISSING if effective is None else round(effective, 6),
            "StartTime": round(self.starts_s, 6),
            "PhysioType": "generic",
            "MissingValues": MISSING,
            "Columns": [LATENCY, *names],
            LATENCY: {"Description": "time of the sample on the robot's clock, since the first one", "Units": "s"},
            **columns,
            "StreamType": stream.kind or MISSING,
            "SampleCount": self._samples,
            "RowsWithoutSample": self._missing,
            "SamplesLeftOut": self._dropped,
            "Connections": len(stream.clocks),
        }


def _unique(names: list[str], count: int) -> list[str]:
    """So many different names; each that is taken or missing gets its number."""
    found = list[str]()
    for k in range(count):
        name = names[k] if k < len(names) else f"channel{k + 1}"
        number = k + 1
        while name in [*found, LATENCY]:
            name, number = f"{name}{number}", number + 1
        found.append(name)
    return found
