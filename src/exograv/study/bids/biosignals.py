"""Streams of EEG and EMG as files of the data types `eeg` and `emg`, at even times of the session's clock."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.recording.device_stream import DeviceStream
from exograv.study.biosignal_channels import VOLTAGES, BiosignalChannel, channels_of
from exograv.study.even_times import EvenTimes, effective_rate, even_times, monotonic_of, placed_stretches
from exograv.study.folder.stream_settings import BiosignalType, StreamSettings
from exograv.study.sync import ARRIVAL_S

from .bdf import DIGITAL_MAX, ERROR_MAX_UV, BdfChannel, rounding_error, stored_range, write_bdf
from .files import MISSING, write_json, write_table
from .interpolation import FLAT_TO, HALF_TAPS, OVERSHOOT, StretchSignal
from .names import SessionPlace
from .staging import StagedSamples

ROWS_AT_ONCE = 16384

TIMING = (
    "Resampled to even times of the session's clock: jitter of the stamps removed by a line with knots, drift of the "
    "device's clock removed by LSL's clock corrections. The samples as received are in the recording."
)
AXES = "As in the stream: origin in the centre of the head, x to the right, y to the front, z to the top"


@dataclass(frozen=True)
class PartWithoutSamples:
    """Part of a file in which the device sent nothing; its values are interpolated."""

    t: float
    """Beginning on the session's clock [s]."""

    seconds: float


@dataclass(frozen=True)
class BiosignalFile:
    """Written file of an EEG or EMG stream."""

    table: PurePosixPath
    """The data file, by its path from the root."""

    kind: BiosignalType
    events: PurePosixPath
    first_t: float
    """First row on the session's clock [s]."""

    gaps: Sequence[PartWithoutSamples]
    not_stated: Sequence[str]
    """Names of statements in study.toml that the user may add."""


@dataclass(frozen=True)
class Biosignal:
    """Samples of one stream with their times and channels, ready to be written."""

    stream: DeviceStream
    kind: BiosignalType
    stated: StreamSettings
    channels: Sequence[BiosignalChannel]
    staged: StagedSamples
    times: EvenTimes
    effective_Hz: float | None

    @classmethod
    def of(
        cls, stream: DeviceStream, kind: BiosignalType, stated: StreamSettings, staged: StagedSamples
    ) -> "Biosignal | str":
        """Return the signal of a stream with at least one sample, or the reason why it is no file of this type."""
        channels = channels_of(stream, kind, stated)
        if isinstance(channels, str):
            return channels
        if not staged.is_finite:
            return "it has values that are not finite"
        arrival = staged.received - monotonic_of(stream, staged.stamps, staged.connection)
        if not np.isfinite(arrival).any():
            return "no connection has a measured clock"
        if not ARRIVAL_S[0] <= np.nanmedian(arrival) <= ARRIVAL_S[1]:
            return "it does not stamp by LSL's clock, so its time is not known"
        for one, range_ in zip(channels, _ranges(channels, staged), strict=True):
            if range_ > DIGITAL_MAX or (one.type in VOLTAGES and rounding_error(range_) > ERROR_MAX_UV):
                return f"a value of channel '{one.name}' is too large for the file: correct its unit"
        stretches = placed_stretches(stream, staged.stamps, staged.connection)
        times = even_times(stretches, stream.nominal_rate_Hz)
        if times is None:
            return "its clock jumps by more than an hour"
        return cls(stream, kind, stated, channels, staged, times, effective_rate(stretches))

    def write(
        self, root: Path, place: SessionPlace, label: str, first_t: float, about: Mapping[str, Any]
    ) -> BiosignalFile:
        """Write the files of the stream.

        Args:
            root: Folder of the data set.
            place: Paths of the session.
            label: Label that distinguishes streams of one type; empty for a single one.
            first_t: Beginning of the session's motion [s].
            about: Content that all sidecars of the session share.
        """
        short = self.kind.lower()
        table = place.biosignal(self.kind, label, f"{short}.bdf")
        (root / table).parent.mkdir(parents=True, exist_ok=True)
        channels = [
            BdfChannel(one.name, one.unit, range_)
            for one, range_ in zip(self.channels, _ranges(self.channels, self.staged), strict=True)
        ]
        added = write_bdf(root / table, channels, self.times.rate_Hz, self._rows())
        rate, begin = self.times.rate_Hz, self.times.first_t
        parts = [*self.times.gaps, *([(self.times.rows, added)] if added else [])]
        gaps = [PartWithoutSamples(begin + first / rate, rows / rate) for first, rows in parts]
        voltages = [two.range for one, two in zip(self.channels, channels, strict=True) if one.type in VOLTAGES]
        error = rounding_error(max(voltages))
        content = {**about, **self._sidecar(), "StartTime": round(begin - first_t, 6), "RoundingErrorMax_uV": error}
        write_json((root / table).with_suffix(".json"), content)
        rows = [self._row(one) for one in self.channels]
        write_table(root / place.biosignal(self.kind, label, "channels.tsv"), self._columns, rows)
        self._write_electrodes(root, place, label)
        events = place.biosignal(self.kind, label, "events.tsv")
        return BiosignalFile(table, self.kind, events, begin, gaps, self._not_stated())

    def _rows(self) -> Iterator[Float[np.ndarray, "row channel"]]:
        """Yield the rows of the file; rows without a sample lie on a line between their neighbours."""
        gaps, last = dict(self.times.gaps), np.empty(0)
        row = 0
        for run in self.times.runs:
            signal = StretchSignal(self.staged.values(), run.stretch)
            for first, end in pairwise([*range(0, run.rows, ROWS_AT_ONCE), run.rows]):
                block = self._values(signal, self.times.positions(run, first, end))
                if row in gaps:
                    yield from _filled(last, block[0], gaps[row])
                    row += gaps[row]
                yield block
                row, last = row + len(block), block[-1]

    def _values(self, signal: StretchSignal, positions: Float[np.ndarray, " row"]) -> Float[np.ndarray, "row channel"]:
        found = signal.at(positions)
        if stepped := [k for k, one in enumerate(self.channels) if one.is_stepped]:
            found[:, stepped] = signal.nearest(positions)[:, stepped]
        return found * [one.scale for one in self.channels]

    def _sidecar(self) -> dict[str, Any]:
        stated, kind, seconds = self.stated, self.kind, self.times.rows / self.times.rate_Hz
        residual = max(float(np.abs(fit.residual).max()) for fit in self.stream.clocks.values())
        counted = ("EEG", "EMG", "ECG", "EOG", "MISC") if kind == "EEG" else ("EMG",)
        interpolation = {
            "Kind": "sinc with a Kaiser window, no delay",
            "Taps": 2 * HALF_TAPS,
            "TrueTo_Hz": FLAT_TO * self.times.rate_Hz / 2.0,
        }
        return {
            f"{kind}Reference": stated.reference or MISSING,
            f"{kind}Ground": stated.ground or MISSING,
            **self._placement(),
            **self._device(),
            "PowerLineFrequency": stated.power_line_Hz or MISSING,
            "SamplingFrequency": self.times.rate_Hz,
            "SamplingFrequencyEffective": MISSING if self.effective_Hz is None else round(self.effective_Hz, 6),
            "NominalFrequencyOfDevice": self.stream.nominal_rate_Hz,
            "SoftwareFilters": {"Interpolation": interpolation},
            "HardwareFilters": MISSING,
            "RecordingType": "continuous",
            "RecordingDuration": round(seconds, 6),
            **{f"{one}ChannelCount": sum(channel.type == one for channel in self.channels) for one in counted},
            "TriggerChannelCount": sum(channel.type == "TRIG" for channel in self.channels),
            "Timing": TIMING,
            "ClockResidualMax_s": round(residual, 9),
            "SampleCount": len(self.staged.stamps),
            "SamplesLeftOut": self._left_out(),
            "RowsWithoutSample": sum(rows for _, rows in self.times.gaps),
            "Connections": len(self.stream.clocks),
        }

    def _placement(self) -> dict[str, str]:
        if self.kind == "EEG":
            return {"EEGPlacementScheme": self.stated.placement or MISSING}
        return {"EMGPlacementScheme": "Other", "EMGPlacementSchemeDescription": self.stated.placement or MISSING}

    def _device(self) -> dict[str, str]:
        """Return what the stream says about its device, by the metadata of XDF."""
        told = {
            "Manufacturer": "desc/acquisition/manufacturer",
            "ManufacturersModelName": "desc/acquisition/model",
            **({"CapManufacturersModelName": "desc/cap/name"} if self.kind == "EEG" else {}),
        }
        electrodes = {"ElectrodeManufacturer": MISSING, "ElectrodeManufacturersModelName": MISSING}
        own = {"CapManufacturer": MISSING} if self.kind == "EEG" else electrodes
        return {**own, **{key: self.stream.description.findtext(path) or MISSING for key, path in told.items()}}

    def _left_out(self) -> int:
        known = np.isin(self.staged.connection, list(self.stream.clocks))
        return int(np.count_nonzero(~known)) + self.times.left_out

    @property
    def _columns(self) -> list[str]:
        own = ["target_muscle"] if self.kind == "EMG" else []
        return ["name", "type", "units", "sampling_frequency", "reference", *own]

    def _row(self, channel: BiosignalChannel) -> dict[str, str | int]:
        """Return a row of `_channels.tsv`."""
        is_referenced = channel.type == self.kind and self.stated.reference
        reference = self.stated.reference if is_referenced else MISSING
        basic: dict[str, str | int] = {"name": channel.name, "type": channel.type, "units": channel.unit or MISSING}
        own = {"target_muscle": channel.muscle or MISSING} if self.kind == "EMG" else {}
        return {**basic, "sampling_frequency": self.times.rate_Hz, "reference": reference, **own}

    def _write_electrodes(self, root: Path, place: SessionPlace, label: str) -> None:
        """Write the places of electrodes, if the stream states that of every EEG channel."""
        channels = [one for one in self.channels if one.type == "EEG"]
        if self.kind != "EEG" or any(one.place_mm is None for one in channels):
            return
        rows = [{"name": one.name, **dict(zip("xyz", one.place_mm or (), strict=True))} for one in channels]
        write_table(root / place.biosignal(self.kind, label, "electrodes.tsv"), ["name", "x", "y", "z"], rows)
        axes = {
            "EEGCoordinateSystem": "Other",
            "EEGCoordinateUnits": "mm",
            "EEGCoordinateSystemDescription": AXES,
        }
        write_json(root / place.biosignal(self.kind, label, "coordsystem.json"), axes)

    def _not_stated(self) -> list[str]:
        needed = {
            "reference": self.stated.reference,
            "placement": self.stated.placement,
            "power_line_Hz": self.stated.power_line_Hz,
        }
        return [name for name, value in needed.items() if not value]


def _ranges(channels: Sequence[BiosignalChannel], staged: StagedSamples) -> list[float]:
    """Return the range of each channel in the file; an interpolated value may exceed the samples around it.

    Whole numbers of a trigger are stored as they are: MNE reads them so, whatever range the header states.
    """
    found = list[float]()
    for one, largest, is_whole in zip(channels, staged.largest, staged.is_whole, strict=True):
        if one.type == "TRIG" and is_whole and largest <= DIGITAL_MAX:
            found.append(float(DIGITAL_MAX))
        else:
            found.append(stored_range(largest * one.scale * (1.0 if one.is_stepped else OVERSHOOT)))
    return found


def _filled(
    before: Float[np.ndarray, " channel"], after: Float[np.ndarray, " channel"], rows: int
) -> Iterator[Float[np.ndarray, "row channel"]]:
    """Yield rows that lie on a line between two rows."""
    for first in range(0, rows, ROWS_AT_ONCE):
        share = (np.arange(first, min(first + ROWS_AT_ONCE, rows)) + 1.0) / (rows + 1.0)
        yield before + share[:, None] * (after - before)
