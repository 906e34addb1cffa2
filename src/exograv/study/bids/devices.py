"""Streams of other devices: EEG and EMG as files of their own type, other streams as `_physio.tsv.gz`.

A physiological recording has the values as received, on the robot's clock, and gaps as rows of n/a. A stream without a
rate, a stream of text, or a stream that cannot be placed on the robot's clock is not exported and stays in the
recording.
"""

from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from gzip import GzipFile
from pathlib import Path, PurePosixPath
from tempfile import TemporaryFile
from types import MappingProxyType
from typing import Any

import numpy as np

from exograv.recording import Recording
from exograv.recording.device_stream import DeviceStream, joined, rig_time
from exograv.recording.stream_block import GAP_PERIODS, StreamBlock
from exograv.study.biosignal_channels import Stated, statements_on, type_of
from exograv.study.folder.stream_settings import BiosignalType, StreamSettings

from .biosignals import Biosignal, BiosignalFile
from .files import MISSING, number_rows, packed, write_json
from .names import EXO, SessionPlace, label
from .staging import StagedSamples

FILL_MAX_S = 3600.0
"""Longest gap that is filled with empty rows [s]. A longer gap is a jump of the clock."""

TIME_DECIMALS, VALUE_DECIMALS = 6, 9
LATENCY = "latency"


@dataclass(frozen=True)
class Left:
    """Stream that is not exported. Its name is not repeated, because a person typed it."""

    kind: str
    why: str

    as_physio: bool = False
    """True for a stream of EEG or EMG that is exported as a physiological recording only."""


def device_streams(recording: Recording) -> tuple[list[DeviceStream], list[Left]]:
    """Return the exportable streams of a recording, still without samples, and the others with a reason.

    A stream is exportable if it has a rate and can be placed on the robot's clock.

    Args:
        recording: Recording with the messages of `/stream` and `/correction`, and ticks that have both clocks.
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
        return "its clock was never measured"
    if not np.isfinite(stream.ticks["monotonic"]).any():
        return "the relation of the robot's clock to the computer's is not known"
    return None


@dataclass(frozen=True)
class DeviceFiles:
    """Written files of a session's streams."""

    physio: dict[PurePosixPath, float]
    """Beginning of each physiological recording after the motion's [s], by its path from the root."""

    biosignals: list[BiosignalFile]
    left: list[Left]


@dataclass(frozen=True)
class _Staged:
    """Stream of EEG or EMG while its samples are collected."""

    stream: DeviceStream
    kind: BiosignalType
    stated: StreamSettings
    samples: StagedSamples


class Devices:
    """Files of a session's streams while they are written. `with Devices(...) as devices:` closes them."""

    def __init__(
        self,
        root: Path,
        place: SessionPlace,
        recording: Recording,
        first_t: float,
        stated: Stated = MappingProxyType({}),
    ):
        """Prepare the streams; no file is written yet.

        Args:
            root: Folder of the data set.
            place: Paths of the session.
            recording: Recording as for `device_streams`.
            first_t: Beginning of the session's motion [s].
            stated: Statements of the study about streams, by name or type.
        """
        self._streams, self._left = device_streams(recording)
        self._root, self._place, self._first_t, self._stated = root, place, first_t, stated
        self._stack = ExitStack()
        self._physio = dict[str, _Physio]()
        self._staged = dict[str, _Staged]()

    def __enter__(self) -> "Devices":
        short = _unique([label(stream.kind) or "device" for stream in self._streams], len(self._streams))
        for stream, name in zip(self._streams, short, strict=True):
            table = self._place.motion(EXO, f"recording-{name}_physio.tsv.gz")
            self._physio[stream.topic] = _Physio(stream, self._root, table, self._first_t)
            stated = statements_on(stream, self._stated)
            if kind := type_of(stream, stated):
                samples = StagedSamples(self._stack.enter_context(TemporaryFile(dir=self._root)))
                self._staged[stream.topic] = _Staged(stream, kind, stated, samples)
            else:
                self._stack.enter_context(self._physio[stream.topic])
        return self

    def __exit__(self, *_error: object) -> None:
        self._stack.close()

    def take(self, topic: str, block: StreamBlock) -> None:
        """Take the samples of a block, if its stream is exported."""
        if topic in self._staged:
            self._staged[topic].samples.take(block)
        elif topic in self._physio:
            self._physio[topic].take(block)

    def finish(self, about: Mapping[str, Any]) -> DeviceFiles:
        """Write the files of EEG and EMG and all sidecars, and remove the files of streams without a sample."""
        biosignals = self._biosignals(about)
        physio = dict[PurePosixPath, float]()
        for writer in self._physio.values():
            if not writer.is_open:
                continue
            writer.close()
            path = self._root / writer.table
            if writer.first is None:
                path.unlink()
                self._left.append(Left(writer.stream.kind, "it sent nothing"))
            else:
                write_json(path.with_name(path.name.replace(".tsv.gz", ".json")), {**about, **writer.sidecar()})
                physio[writer.table] = writer.starts_s
        return DeviceFiles(physio, biosignals, self._left)

    def _biosignals(self, about: Mapping[str, Any]) -> list[BiosignalFile]:
        """Write the files of EEG and EMG. A stream that does not fit is written as a physiological recording."""
        signals = list[Biosignal]()
        for topic, one in self._staged.items():
            if one.samples.is_empty:
                self._left.append(Left(one.stream.kind, "it sent nothing"))
                continue
            signal = Biosignal.of(one.stream, one.kind, one.stated, one.samples)
            if isinstance(signal, str):
                self._left.append(Left(one.kind, signal, as_physio=True))
                writer = self._stack.enter_context(self._physio[topic])
                for block in one.samples.blocks():
                    writer.take(block)
            else:
                signals.append(signal)
        kinds = [signal.kind for signal in signals]
        labels = [f"{kind}{kinds[:k].count(kind) + 1}" if kinds.count(kind) > 1 else "" for k, kind in enumerate(kinds)]
        return [
            signal.write(self._root, self._place, short, self._first_t, about)
            for signal, short in zip(signals, labels, strict=True)
        ]


class _Physio:
    """Physiological recording of one stream. `with` opens its file and closes it."""

    def __init__(self, stream: DeviceStream, root: Path, table: PurePosixPath, first_t: float):
        self.stream, self.table = stream, table
        self.first: float | None = None
        self._root, self._begin, self._stack = root, first_t, ExitStack()
        self._file: GzipFile | None = None
        self._last = -np.inf
        self._missing = self._dropped = self._steady = self._samples = 0
        self._steady_s = 0.0

    def __enter__(self) -> "_Physio":
        self._file = self._stack.enter_context(packed(self._root / self.table))
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def close(self) -> None:
        """Complete the file of this stream."""
        self._stack.close()

    @property
    def is_open(self) -> bool:
        """Return True if the file was opened."""
        return self._file is not None

    @property
    def starts_s(self) -> float:
        """Time from the first sample of the motion to that of this stream [s]."""
        return 0.0 if self.first is None else self.first - self._begin

    def take(self, block: StreamBlock) -> None:
        """Write samples. Samples without a clock of their connection, or not later than others, are only counted."""
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
        # Rows for missing samples lie evenly between their neighbours.
        known = np.concatenate([[-1], rows])
        table[:, 0] = np.interp(np.arange(len(table)), known, np.concatenate([[self._last], t]))
        table[:, 0] -= self.first or 0.0
        assert self._file is not None
        self._file.write(number_rows(list(table.T), [TIME_DECIMALS] + [VALUE_DECIMALS] * values.shape[1]))

    def sidecar(self) -> dict[str, Any]:
        """Return the sidecar of the file."""
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
            LATENCY: {"Description": "time of the sample on the robot's clock, since the first sample", "Units": "s"},
            **columns,
            "StreamType": stream.kind or MISSING,
            "SampleCount": self._samples,
            "RowsWithoutSample": self._missing,
            "SamplesLeftOut": self._dropped,
            "Connections": len(stream.clocks),
        }


def _unique(names: list[str], count: int) -> list[str]:
    """Return `count` different names; a name that is taken or missing gets its number."""
    found = list[str]()
    for k in range(count):
        name = names[k] if k < len(names) else f"channel{k + 1}"
        number = k + 1
        while name in [*found, LATENCY]:
            name, number = f"{name}{number}", number + 1
        found.append(name)
    return found
