"""Buffer of the ticks for the next chunk."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from mcap.opcode import Opcode

from .container import INDEX_ENTRY, MESSAGE, MESSAGE_HEAD
from .encoding import CDR_HEADER, TICK_DEFAULTS, tick_dtype
from .schema import TICK

T_MAX_S = 1e9
"""Largest time that is written, three decades [s]; log times are unsigned nanoseconds of 64 bits."""


def sound_times(t: np.ndarray) -> np.ndarray:
    """Return times [s] that the file format can represent. An invalid time of a failed clock becomes 0."""
    return np.where((t >= 0.0) & (t < T_MAX_S), t, 0.0)


class TickBlock:
    """Ticks of one chunk, each a complete message record in place, so that recording a tick is a few copies."""

    def __init__(self, channel: int, n_joints: int, size_bytes: int):
        tick = tick_dtype(n_joints)
        self._rows = np.zeros(size_bytes // (MESSAGE.itemsize + tick.itemsize), [("head", MESSAGE), ("tick", tick)])
        self._rows["head"]["opcode"] = Opcode.MESSAGE
        self._rows["head"]["length"] = MESSAGE_HEAD.size + tick.itemsize
        self._rows["head"]["channel"] = channel
        self._rows["tick"]["cdr_header"] = np.frombuffer(CDR_HEADER, np.uint8)
        columns = {field.name: self._rows["tick"][field.name] for field in TICK.fields}
        self._t, self._phase = columns.pop("t"), columns.pop("phase")
        self._columns = columns
        self._n = 0
        self.phase = 0
        """Phase of the next ticks: number of `/phase` messages so far."""

    def __len__(self) -> int:
        """Return the number of ticks in the buffer."""
        return self._n

    @property
    def is_full(self) -> bool:
        """True if there is no room for another tick."""
        return self._n == len(self._rows)

    def add(self, t: float, values: Mapping[str, Any]) -> None:
        """Put one tick into the next row."""
        values = TICK_DEFAULTS | dict(values)
        if len(values) != len(self._columns):
            raise ValueError(f"/tick needs {', '.join(self._columns)}; given: {', '.join(values)}.")
        n = self._n
        # A value that 32 bits cannot hold is recorded as infinite, without a warning at the terminal.
        with np.errstate(over="ignore"):
            for name, value in values.items():
                self._columns[name][n] = value
        self._t[n] = t
        self._phase[n] = self.phase
        self._n = n + 1

    def add_rows(self, rows: np.ndarray) -> int:
        """Add as many of these packed ticks (tick,) as there is room for, and return their number."""
        first, last = self._n, min(self._n + len(rows), len(self._rows))
        ticks = self._rows["tick"][first:last]
        ticks[:] = rows[: last - first]
        ticks["cdr_header"] = np.frombuffer(CDR_HEADER, np.uint8)
        self._n = last
        return last - first

    @property
    def ticks(self) -> np.ndarray:
        """Ticks in the buffer (tick,), as a view."""
        return self._rows["tick"][: self._n]

    def take(self, offset: int, every: int = 1) -> tuple[bytes, np.ndarray]:
        """Empty the block; return its records, and their index for a chunk in which they begin at `offset` [bytes].

        Only each tick of so many is returned, the first one included.
        """
        rows, self._n = self._rows[: self._n : every].copy(), 0
        entries = np.empty(len(rows), INDEX_ENTRY)
        entries["time_ns"] = np.rint(1e9 * sound_times(rows["tick"]["t"]))
        entries["offset"] = offset + rows.itemsize * np.arange(len(rows))
        rows["head"]["times_ns"] = entries["time_ns"][:, None]
        return rows.tobytes(), entries
