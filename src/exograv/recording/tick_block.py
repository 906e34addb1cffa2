"""Buffer of the ticks for the next chunk."""

import struct
from typing import cast

import numpy as np
from mcap.opcode import Opcode

from exograv.signals import Joints

from .container import INDEX_ENTRY, MESSAGE, MESSAGE_HEAD
from .encoding import CDR_HEADER, tick_dtype
from .tick_row import JOINT_FIELDS, SCALARS, TickRow

T_MAX_S = 1e9
"""Largest time that is written, three decades [s]; log times are unsigned nanoseconds of 64 bits."""


STAGED = 256
"""Ticks that wait as rows of 64-bit numbers before they become records, all at once."""


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
        self._n = self._staged = 0
        self._lay_out_stage(n_joints)
        self.phase = 0
        """Phase of the next ticks: number of `/phase` messages so far."""

    def _lay_out_stage(self, n_joints: int) -> None:
        """Prepare the stage, where a tick is one row of 64-bit numbers: scalars, phase, joint fields.

        A value that goes straight into its column of mixed types takes ten times as long.
        """
        scalars = [*SCALARS, "phase"]
        self._scalars = struct.Struct(f"={len(scalars)}d")
        self._stage = np.zeros((STAGED, len(scalars) + n_joints * len(JOINT_FIELDS)))
        self._bytes = self._stage.data.cast("B") if self._stage.size else memoryview(b"")
        self._row_bytes, self._address = self._stage.strides[0], self._stage.ctypes.data
        self._columns = [(name, self._stage[:, k]) for k, name in enumerate(scalars)]
        starts = [len(scalars) + k * n_joints for k in range(len(JOINT_FIELDS))]
        self._columns += [
            (name, self._stage[:, k : k + n_joints]) for name, k in zip(JOINT_FIELDS, starts, strict=True)
        ]

    def __len__(self) -> int:
        """Return the number of ticks in the buffer."""
        return self._n + self._staged

    @property
    def is_full(self) -> bool:
        """True if there is no room for another tick."""
        return self._n + self._staged == len(self._rows)

    def add(self, row: TickRow) -> None:
        """Put one tick into the next row.

        Raises:
            ValueError: An array has another number of joints; or, in the first tick of a stage, it is not of float64.
        """
        n, begin = len(SCALARS), self._staged * self._row_bytes
        arrays = cast("tuple[Joints, ...]", row[n:])
        packed = b"".join((self._scalars.pack(*row[:n], self.phase), *arrays))  # pyright: ignore[reportArgumentType]
        if len(packed) != self._row_bytes or (self._staged == 0 and any(one.dtype != np.float64 for one in arrays)):
            shapes = ", ".join(
                f"{name} {one.shape} {one.dtype}" for name, one in zip(JOINT_FIELDS, arrays, strict=True)
            )
            raise ValueError(f"The arrays of a tick must be (joint,) of float64. Given: {shapes}.")
        self._bytes[begin : begin + self._row_bytes] = packed
        self.end_row()

    def next_row(self) -> int:
        """Address of the next row of the stage: scalars, phase, joint fields, all of 64 bits, for a caller in C.

        `end_row` adds the row.
        """
        return self._address + self._staged * self._row_bytes

    def end_row(self) -> None:
        """Add the row that was written at `next_row`."""
        self._staged += 1
        if self._staged == STAGED or self.is_full:
            self._settle()

    def _settle(self) -> None:
        """Copy the staged ticks, column by column, into the rows that are written to the file."""
        if not self._staged:
            return
        ticks = self._rows["tick"][self._n : self._n + self._staged]
        # A value that 32 bits cannot hold is recorded as infinite, without a warning at the terminal.
        with np.errstate(over="ignore"):
            for name, column in self._columns:
                ticks[name] = column[: self._staged]
        self._n, self._staged = self._n + self._staged, 0

    def add_rows(self, rows: np.ndarray) -> int:
        """Add as many of these packed ticks (tick,) as there is room for, and return their number."""
        self._settle()
        first, last = self._n, min(self._n + len(rows), len(self._rows))
        ticks = self._rows["tick"][first:last]
        ticks[:] = rows[: last - first]
        ticks["cdr_header"] = np.frombuffer(CDR_HEADER, np.uint8)
        self._n = last
        return last - first

    @property
    def ticks(self) -> np.ndarray:
        """Ticks in the buffer (tick,), as a view."""
        self._settle()
        return self._rows["tick"][: self._n]

    def take(self, offset: int, every: int = 1) -> tuple[bytes, np.ndarray]:
        """Empty the block; return its records, and their index for a chunk in which they begin at `offset` [bytes].

        Only each tick of so many is returned, the first one included.
        """
        self._settle()
        rows, self._n = self._rows[: self._n : every].copy(), 0
        entries = np.empty(len(rows), INDEX_ENTRY)
        entries["time_ns"] = np.rint(1e9 * sound_times(rows["tick"]["t"]))
        entries["offset"] = offset + rows.itemsize * np.arange(len(rows))
        rows["head"]["times_ns"] = entries["time_ns"][:, None]
        return rows.tobytes(), entries
