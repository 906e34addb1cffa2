"""BDF file: 24 bits per value, written a minute at a time, with the same bytes for the same content."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from edfio import Bdf, BdfSignal
from jaxtyping import Float

DIGITAL_MAX = 2**23 - 1

ERROR_MAX_UV = 0.1
"""Largest rounding error of a voltage that is accepted [µV]. 16 bits would keep it within ±6.5 mV only."""

RECORDS = 60
"""Records of one second that are written at a time."""

COUNT_AT = slice(236, 244)
"""Bytes of the header that hold the number of records. Source: https://www.edfplus.info/specs/edf.html."""


@dataclass(frozen=True)
class BdfChannel:
    """Channel of a BDF file."""

    label: str
    """Name of at most 16 ASCII characters."""

    unit: str
    """Unit of at most 8 ASCII characters; empty for none."""

    range: float
    """Largest absolute value that can be stored."""


def stored_range(largest: float) -> float:
    """Return the range for absolute values up to `largest`: 1, 2 or 5 times a power of ten, which the header keeps."""
    if not largest > 0.0:
        return 1.0
    power = 10.0 ** np.floor(np.log10(largest))
    return next(float(f"{k * power:.0e}") for k in (1, 2, 5, 10) if largest <= k * power)


def rounding_error(range_: float) -> float:
    """Return the largest rounding error of values in a range."""
    return range_ / DIGITAL_MAX / 2.0


def write_bdf(
    path: Path, channels: Sequence[BdfChannel], rate_Hz: int, blocks: Iterator[Float[np.ndarray, "row channel"]]
) -> int:
    """Write a file from blocks of rows. The last record is completed with the last row.

    Returns:
        Number of rows that were added to complete the last record.
    """
    records, added = 0, 0
    with path.open("wb") as file:
        for rows in _whole_records(blocks, rate_Hz):
            added = -len(rows) % rate_Hz
            rows = np.concatenate([rows, np.repeat(rows[-1:], added, axis=0)])
            head, data = _encoded(channels, rate_Hz, rows)
            file.write(data if records else head + data)
            records += len(rows) // rate_Hz
        file.seek(COUNT_AT.start)
        file.write(f"{records:<8d}".encode())
    return added


def _whole_records(
    blocks: Iterator[Float[np.ndarray, "row channel"]], rate_Hz: int
) -> Iterator[Float[np.ndarray, "row channel"]]:
    """Yield the rows of whole records; the last rows may be fewer."""
    size, kept = RECORDS * rate_Hz, list[np.ndarray]()
    for block in blocks:
        kept.append(block)
        if sum(map(len, kept)) >= size:
            rows = np.concatenate(kept)
            whole = len(rows) // size * size
            yield from np.split(rows[:whole], whole // size)
            kept = [rows[whole:]]
    if rows := [one for one in kept if len(one)]:
        yield np.concatenate(rows)


def _encoded(channels: Sequence[BdfChannel], rate_Hz: int, rows: np.ndarray) -> tuple[bytes, bytes]:
    """Return header and records of some rows."""
    signals = [
        BdfSignal.from_digital(
            np.round(np.clip(values / one.range, -1.0, 1.0) * DIGITAL_MAX).astype(np.int32),
            rate_Hz,
            label=one.label,
            physical_dimension=one.unit,
            physical_range=(-one.range, one.range),
            digital_range=(-DIGITAL_MAX, DIGITAL_MAX),
        )
        for one, values in zip(channels, rows.T, strict=True)
    ]
    buffer = BytesIO()
    Bdf(signals, data_record_duration=1).write(buffer)
    content, head = buffer.getvalue(), 256 * (1 + len(channels))
    return content[:head], content[head:]


@dataclass(frozen=True)
class BdfHeader:
    """Size of a BDF file by its header, for a check against its sidecar files."""

    channels: int
    records: int
    bytes: int


def read_bdf_header(path: Path) -> BdfHeader:
    """Read the number of channels and records, and the size that the file must have."""
    with path.open("rb") as file:
        head = file.read(256)
        channels, records = int(head[252:256]), int(head[COUNT_AT])
        file.seek(256 + 216 * channels)
        samples = sum(int(file.read(8)) for _ in range(channels))
    return BdfHeader(channels, records, 256 * (1 + channels) + 3 * samples * records)
