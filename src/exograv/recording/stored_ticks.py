"""Ticks that stay in the file: the chosen fields are read again, chunk by chunk, at each request."""

from array import array
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from .contents import ChunkPart, parts_at
from .encoding import TICK_DEFAULTS, stored_rows, tick_dtype
from .file_content import foreign_messages_refused, read_content
from .schema import TICK


@dataclass
class StoredTicks:
    """Places of the ticks of a file, chunk by chunk."""

    path: Path
    n_joints: int
    version: int
    """Version of the format of the file."""

    topics: dict[int, str]
    """Topics of the channels, by channel number."""

    counts: dict[int, int] = field(default_factory=dict)
    """Number of ticks by phase number."""

    _chunks: array = field(default_factory=lambda: array("Q"))
    _first: array = field(default_factory=lambda: array("L"))
    _last: array = field(default_factory=lambda: array("L"))

    def add(self, part: ChunkPart) -> np.ndarray:
        """Note a part of a chunk with ticks of which at least `t` and `phase` are unpacked; return these two."""
        ticks = chosen(part.data, ("t", "phase"), self.n_joints, self.version)
        if not len(ticks):
            return ticks
        numbers, counts = np.unique(ticks["phase"], return_counts=True)
        for number, count in zip(numbers.tolist(), counts.tolist(), strict=True):
            self.counts[number] = self.counts.get(number, 0) + count
        first, last = int(numbers[0]), int(numbers[-1])
        if self._chunks and self._chunks[-1] == part.chunk:
            self._first[-1], self._last[-1] = min(self._first[-1], first), max(self._last[-1], last)
        else:
            self._chunks.append(part.chunk)
            self._first.append(first)
            self._last.append(last)
        return ticks

    def pieces(self, fields: Sequence[str], phase: int | None = None) -> Iterator[np.ndarray]:
        """Yield these fields of all ticks, or of those of one phase, chunk by chunk.

        Raises:
            RecordingError: The file is gone, or another program has written its ticks.
        """
        needed = (*fields, "phase") if phase is not None else tuple(fields)
        # The first pass has unpacked other fields: a message of another number of joints shows only here.
        with read_content(self.path) as content, foreign_messages_refused(self.path):
            for chunk, first, last in zip(self._chunks, self._first, self._last, strict=True):
                if phase is not None and not first <= phase <= last:
                    continue
                for part in parts_at(content, chunk, self.topics, needed):
                    if part.topic == TICK.topic:
                        ticks = chosen(part.data, needed, self.n_joints, self.version)
                        yield ticks if phase is None else ticks[ticks["phase"] == phase]


def chosen(data: bytes | np.ndarray, fields: Collection[str], n_joints: int, version: int) -> np.ndarray:
    """Return these fields of ticks, from their rows or unpacked columns; missing fields have their defaults."""
    stored = data if isinstance(data, np.ndarray) else stored_rows(data, n_joints, version)
    whole = tick_dtype(n_joints)
    ticks = np.zeros(len(stored), [(name, whole[name]) for name in whole.names or () if name in fields])
    for name in ticks.dtype.names or ():
        ticks[name] = stored[name] if name in (stored.dtype.names or ()) else TICK_DEFAULTS[name]
    return ticks


def rows_at(pieces: Iterable[np.ndarray], rows: np.ndarray) -> np.ndarray:
    """Return the ticks with these numbers, counted through the pieces; the numbers rise."""
    found, start = list[np.ndarray](), 0
    for piece in pieces:
        first, last = np.searchsorted(rows, (start, start + len(piece)))
        found.append(piece[rows[first:last] - start])
        start += len(piece)
    return np.concatenate(found)


def last_seconds(pieces: Iterable[np.ndarray], seconds: float) -> np.ndarray | None:
    """Return the ticks of the last seconds by their `t`; None without ticks."""
    kept = list[np.ndarray]()
    for piece in pieces:
        if len(piece):
            kept.append(piece)
            kept = [one for one in kept if one["t"].max() > piece["t"][-1] - seconds]
    if not kept:
        return None
    ticks = np.concatenate(kept)
    return ticks[ticks["t"] > ticks["t"][-1] - seconds]
