"""A file of a sensor, of a format that its content shows, as the data of an aircraft."""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from exograv.errors import RecordingError
from exograv.task.aircraft_line import DAY_MS, AircraftSample, newer_by_ms, parse_line
from exograv.task.aircraft_watch import AircraftWatch
from exograv.task.events import CloseWindow
from exograv.task.task_settings import AircraftSettings

from .sentences import MARK, read_sentences
from .series import Series, checked, flown_samples
from .table import Names, acceleration_columns, channel_columns, column_of, factor_of, read_table

TEXT_BYTES_MAX = 1_000_000_000
"""Largest size of a text file [byte]: about four hours of a sensor with 1 kHz."""

Flight = list[tuple[float, AircraftSample]]
"""Time after the first sample [s], and the sample."""


@dataclass(frozen=True)
class SensorFile:
    """File of a recorded acceleration, and what it does not state itself."""

    path: Path
    names: Names = field(default_factory=Names)
    stream: str | None = None
    """Name of the stream of an XDF file, or of the variable of a MATLAB file."""


@dataclass(frozen=True)
class LoadedFlight:
    """Flight of a file."""

    samples: Flight
    refused: int
    """Rows of the file without a usable sample."""

    gaps: int
    """Gaps in which nothing is sent."""


def load_flight(file: SensorFile, settings: AircraftSettings, level: float) -> LoadedFlight:
    """Load the recorded acceleration of a flight.

    Args:
        file: The file and what it does not state itself.
        settings: Aircraft settings of the protocol. Their limits count the parabolas of a file that does not.
        level: Gravity level of the windows [-].

    Raises:
        RecordingError: The file cannot be read, or holds no acceleration with gravity.
    """
    suffix = file.path.suffix.lower()
    if suffix in (".xdf", ".xdfz"):
        series = _of_xdf(file)
    elif suffix == ".mat":
        series = _of_matlab(file)
    else:
        text = _text(file.path)
        if (flight := _of_lines(text)) is not None:
            return flight
        series = read_sentences(text, file.names.rate_Hz) if MARK in text[:10_000] else read_table(text, file.names)
    return LoadedFlight(list(flown_samples(series, settings, level)), series.refused, series.gaps)


def windows_in(flight: Flight, settings: AircraftSettings, level: float) -> int:
    """Return the number of windows that a flight opens and closes."""
    watch, closed = AircraftWatch(settings, level), 0
    for t, sample in flight:
        watch, events = watch.with_sample(sample, t)
        closed += sum(isinstance(event, CloseWindow) for event in events)
    return closed


def _text(path: Path) -> str:
    try:
        if path.stat().st_size > TEXT_BYTES_MAX:
            raise RecordingError(f"{path} is larger than {1e-9 * TEXT_BYTES_MAX:g} GB. Give a part of it.")
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}. Check the path.") from error
    except UnicodeDecodeError:
        raise RecordingError(
            f"{path} is not a text file. Text, XDF (.xdf, .xdfz) and MATLAB up to version 7 (.mat) are read."
        ) from None


def _of_lines(text: str) -> LoadedFlight | None:
    """Return the flight in recorded lines of the aircraft itself; None if the first line is no such line."""
    lines = [line for line in text.splitlines() if line.strip()]
    if not lines or isinstance(parse_line(lines[0].encode()), str):
        return None
    found, refused = Flight(), 0
    for sample in (parse_line(line.encode()) for line in lines):
        later = 0 if isinstance(sample, str) or not found else newer_by_ms(*_clocks(sample, found[-1][1]))
        if isinstance(sample, str) or (found and later <= 0):
            refused += 1
            continue
        found.append((found[-1][0] + 1e-3 * later if found else 0.0, sample))
    t, g = np.array([t for t, _ in found]), np.array([sample.g for _, sample in found])
    return LoadedFlight(found, refused, checked(t, g).gaps)


def _clocks(later: AircraftSample, earlier: AircraftSample) -> tuple[int, int]:
    return later.since_midnight_ms % DAY_MS, earlier.since_midnight_ms % DAY_MS


def _of_xdf(file: SensorFile) -> Series:
    """Return the acceleration of a stream, with its own stamps."""
    from exograv.study.importers.xdf_stream import load_stream

    if file.stream is None:
        raise RecordingError(f"{file.path.name} may hold several streams. Name that of the acceleration with --stream.")
    stream, _ = load_stream(file.path, file.stream, "Correct --stream.")
    try:
        values = np.array(stream.values, dtype=float)
    except ValueError:
        raise RecordingError(f"Stream '{file.stream}' holds texts, not numbers. Correct --stream.") from None
    axes = acceleration_columns(channel_columns(stream.labels, stream.units, values.shape[1]), file.names)
    g = factor_of(axes, file.names.unit) * values[:, [column.place for column in axes]]
    return checked(stream.stamps, g)


def _of_matlab(file: SensorFile) -> Series:
    """Return the acceleration of a matrix with time [s] and three accelerations in rows or columns."""
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        variables = loadmat(file.path)
    except NotImplementedError:
        raise RecordingError(f"{file.path} is of MATLAB 7.3. Save it in MATLAB with the option '-v7'.") from None
    except OSError as error:
        raise RecordingError(f"{file.path} cannot be read: {error.strerror}. Check the path.") from error
    except (MatReadError, ValueError, TypeError) as error:
        raise RecordingError(f"{file.path} is not a file of MATLAB ({error}).") from None
    matrices = {
        name: value.T if value.shape[0] == 4 else value
        for name, value in variables.items()
        if isinstance(value, np.ndarray) and value.ndim == 2 and 4 in value.shape and value.dtype.kind in "fiu"
    }
    if file.stream is None and len(matrices) == 1:
        (values,) = matrices.values()
    elif file.stream in matrices:
        values = matrices[file.stream]
    else:
        listed = ", ".join(sorted(matrices)) or "none"
        raise RecordingError(
            f"The file holds these matrices of time and three accelerations: {listed}. Name one with --stream."
        )
    axes = [column_of(axis, place) for place, axis in enumerate("xyz")]
    return checked(np.array(values[:, 0], dtype=float), factor_of(axes, file.names.unit) * values[:, 1:])
