"""Tables of a sensor as text: columns are found by their names and units, or named by the caller."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError

from .series import STANDARD_GRAVITY, Series, checked

HEAD_LINES = 200
"""Lines in which the names of the columns must appear. Sensors of some makers write a preamble of a page."""

G_PER_UNIT = {"g": 1.0, "mg": 1e-3, "m/s2": 1.0 / STANDARD_GRAVITY}
"""Acceleration in g by unit."""

S_PER_UNIT = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
"""Time in seconds by unit."""

UNIT_WORDS = {
    "m/s^2": "m/s2", "m/s²": "m/s2", "m/s**2": "m/s2", "ms-2": "m/s2", "ms^-2": "m/s2", "µs": "us", "μs": "us",
    "sec": "s", "seconds": "s", "second": "s", "millis": "ms", "milliseconds": "ms", "microseconds": "us",
    "nanoseconds": "ns",
}  # fmt: skip

UNIT = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]")
TIME = re.compile(r"(unix_?|elapsed_?|sample_?|system_?|local_?|utc_?)*(timestamp|time|date_?time|t|seconds|s)(_?utc)?")
AXIS = re.compile(r"(.*acc[a-z]*|a|j|g_|[a-z_]*_g)_?([xyz])(_.*)?|()([xyz])_?(acc[a-z]*)")
WITHOUT_GRAVITY = re.compile(r"lin|free|user|dyn")


@dataclass(frozen=True)
class Names:
    """Columns and units that the caller names; None where the file itself has to name them."""

    columns: tuple[str, ...] = ()
    """Columns of time and three accelerations, or of three accelerations, by name or by number from 1."""

    unit: str | None = None
    time_unit: str | None = None
    rate_Hz: float | None = None

    @property
    def are_numbers(self) -> bool:
        """True if the columns are named by their numbers."""
        return bool(self.columns) and all(name.isdecimal() and int(name) > 0 for name in self.columns)


@dataclass(frozen=True)
class Column:
    """Column of a table."""

    place: int
    cell: str
    """Name as in the file."""

    name: str
    """Name in small letters, without unit."""

    unit: str | None


def read_table(text: str, names: Names) -> Series:
    """Read the acceleration in a table.

    Raises:
        RecordingError: Columns or units are missing, or the values are no acceleration of a flight.
    """
    lines = [line for line in text.splitlines() if line.strip()]
    separator, begin, header = _header(lines, names)
    axes, time = acceleration_columns(header, names), _time_column(header, names)
    places = [column.place for column in (*axes, *([time] if time else []))]
    plain = _numbers(lines[begin:], separator, places)
    if plain is not None:
        values, moments, refused = plain[:, :3], plain[:, 3:], 0
    else:
        cells = [_cells(line, separator) for line in lines[begin:]]
        rows = [[row[place] for place in places] for row in cells if len(row) > max(places)]
        refused = len(cells) - len(rows)
        values = np.array([[_value(cell, separator) for cell in row[:3]] for row in rows])
        moments = np.array([[_moment(cell, separator) for cell in row[3:]] for row in rows])
    if not len(values):
        raise RecordingError("The file has no row below the names of its columns.")
    if time is not None:
        t = moments[:, 0]
        if plain is not None or _is_number(_cells(lines[begin], separator)[time.place]):
            t = t * _seconds(time, names.time_unit)
    elif names.rate_Hz is not None:
        t = np.arange(len(values)) / names.rate_Hz
    else:
        raise RecordingError("--columns names no time. Name four columns, or give the sensor's rate with --rate.")
    return checked(t, factor_of(axes, names.unit) * values, refused)


def _numbers(
    lines: Sequence[str], separator: str | None, places: Sequence[int]
) -> Float[np.ndarray, "row column"] | None:
    """Return the numbers in these columns; None if a cell holds none. A file of hours takes seconds, not minutes."""
    try:
        return np.loadtxt(lines, delimiter=separator, usecols=places, ndmin=2)
    except ValueError:
        return None


def _header(lines: Sequence[str], names: Names) -> tuple[str | None, int, list[Column]]:
    """Return the separator, the first line of values, and the columns."""
    for number, line in enumerate(lines[:HEAD_LINES]):
        for separator in ("\t", ";", ",", None):
            cells = _cells(line.lstrip("#%/ "), separator)
            if len(cells) < 3:
                continue
            header = [column_of(cell, place) for place, cell in enumerate(cells)]
            if names.are_numbers:
                places = [int(name) - 1 for name in names.columns]
                if max(places) < len(cells) and all(_is_number(cells[place]) for place in places[-3:]):
                    return separator, number, header
            elif set(names.columns) <= set(cells) if names.columns else any(_axes(header).values()):
                return separator, number + 1, header
    shown = lines[0][:80] if lines else ""
    wanted = f"the columns {', '.join(names.columns)}" if names.columns else "names of three acceleration columns"
    raise RecordingError(
        f"The first {HEAD_LINES} lines do not hold {wanted}; the file begins with '{shown}'. Name time and three "
        "accelerations with --columns, by name or by number from 1, such as --columns 1 3 4 5."
    )


def acceleration_columns(header: Sequence[Column], names: Names) -> list[Column]:
    """Return the columns of the three accelerations.

    Raises:
        RecordingError: A named column is not there, or the file does not have just one acceleration with gravity.
    """
    listed = ", ".join(column.cell for column in header)
    if names.columns:
        found = [_named(header, name) for name in names.columns[-3:]]
        if None in found:
            raise RecordingError(f"--columns is {' '.join(names.columns)}; the file has {listed}.")
        return [column for column in found if column is not None]
    groups = {stem: axes for stem, axes in _axes(header).items() if len(axes) == 3}
    with_gravity = {stem: axes for stem, axes in groups.items() if not WITHOUT_GRAVITY.search(stem)}
    if len(with_gravity) != 1:
        kind = "three accelerations with gravity" if not with_gravity else "a single sensor"
        raise RecordingError(f"The columns {listed} are not those of {kind}. Name them with --columns.")
    (axes,) = with_gravity.values()
    return [axes[axis] for axis in "xyz"]


def _time_column(header: Sequence[Column], names: Names) -> Column | None:
    """Return the column of the time; None if the rate gives it."""
    if names.columns:
        return _named(header, names.columns[0]) if len(names.columns) == 4 else None
    found = next((column for column in header if TIME.fullmatch(column.name)), None)
    if found is None and names.rate_Hz is None:
        listed = ", ".join(column.cell for column in header)
        raise RecordingError(f"None of the columns {listed} is a time. Name it with --columns, or give --rate.")
    return found


def _named(header: Sequence[Column], name: str) -> Column | None:
    return next((column for column in header if name in (column.cell, str(column.place + 1))), None)


def _axes(header: Sequence[Column]) -> dict[str, dict[str, Column]]:
    """Return columns of acceleration by sensor and axis."""
    found = dict[str, dict[str, Column]]()
    for column in header:
        if match := AXIS.fullmatch(column.name):
            stem, axis = (match[1] or match[4] or "") + (match[3] or match[6] or ""), match[2] or match[5]
            found.setdefault(stem, {})[axis] = column
    return found


def _seconds(column: Column, given: str | None) -> float:
    """Return the unit of the times of a column [s]."""
    unit = given or column.unit
    if unit not in S_PER_UNIT:
        raise RecordingError(
            f"Column '{column.cell}' states no unit of time. Give it with --time-unit: {', '.join(S_PER_UNIT)}."
        )
    return S_PER_UNIT[unit]


def factor_of(axes: Sequence[Column], given: str | None) -> float:
    """Return the acceleration in g of one unit.

    Raises:
        RecordingError: Neither the caller nor the file states a unit.
    """
    units = {column.unit for column in axes}
    unit = given or (units.pop() if len(units) == 1 else None)
    if unit not in G_PER_UNIT:
        raise RecordingError(f"No unit of acceleration is stated. Give it with --unit: {', '.join(G_PER_UNIT)}.")
    return G_PER_UNIT[unit]


def unit_of(word: str) -> str:
    """Return the unit that a file writes in one of many ways."""
    small = word.strip().lower().replace(" ", "")
    return UNIT_WORDS.get(small, small)


def column_of(cell: str, place: int) -> Column:
    """Return a column from its name in the file, which may have a unit in brackets."""
    unit = UNIT.search(cell)
    name = re.sub(r"[\s.\-]+", "_", UNIT.sub("", cell).strip().strip("\ufeff\"'").lower()).strip("_")
    return Column(place, cell, name, unit_of(unit[1]) if unit else None)


def channel_columns(labels: Sequence[str], units: Sequence[str], count: int) -> list[Column]:
    """Return the channels of a stream. A device may state labels without units, or neither."""
    labels = labels if len(labels) == count else tuple(f"channel {k + 1}" for k in range(count))
    units = units if len(units) == count else ("",) * count
    columns = [column_of(label, place) for place, label in enumerate(labels)]
    return [
        replace(column, unit=unit_of(unit)) if unit else column for column, unit in zip(columns, units, strict=True)
    ]


def _cells(line: str, separator: str | None) -> list[str]:
    return [cell.strip().strip('"') for cell in line.split(separator)]


def _is_number(cell: str) -> bool:
    return math.isfinite(_value(cell, None))


def _value(cell: str, separator: str | None) -> float:
    """Return the number in a cell; NaN if it holds none. A table that is not separated by commas may use them."""
    try:
        return float(cell if separator == "," else cell.replace(",", "."))
    except ValueError:
        return math.nan


def _moment(cell: str, separator: str | None) -> float:
    """Return the number in a cell, or the time of the date in it [s]; NaN if it holds neither."""
    number = _value(cell, separator)
    if not math.isnan(number):
        return number
    try:
        moment = datetime.fromisoformat(cell)
    except ValueError:
        return math.nan
    return (moment if moment.tzinfo else moment.replace(tzinfo=UTC)).timestamp()
