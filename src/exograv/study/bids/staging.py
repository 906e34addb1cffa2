"""Samples of one stream in a temporary file, until all of them are known."""

from collections.abc import Iterator
from typing import IO

import numpy as np

from exograv.recording.stream_block import StreamBlock
from exograv.study.even_times import Samples


class StagedSamples:
    """Samples of a stream in the order of arrival. The values are in a file, the stamps in memory."""

    def __init__(self, file: IO[bytes]):
        """Begin without samples, with an empty file."""
        self._file = file
        self._blocks = list[tuple[float, int, np.ndarray]]()
        self._type: np.dtype | None = None
        self._channels = 0
        self.is_finite = True
        self.largest = np.zeros(0)
        """Largest absolute value of each channel."""

        self.is_whole = np.zeros(0, bool)
        """True for each channel that has whole numbers only."""

    def take(self, block: StreamBlock) -> None:
        """Append the samples of a block."""
        values = np.ascontiguousarray(block.values)
        if not len(values):
            return
        if self._type is None:
            self._type, self._channels = values.dtype, values.shape[1]
            self.largest, self.is_whole = np.zeros(self._channels), np.ones(self._channels, bool)
        self._blocks.append((block.received, block.connection, block.stamps))
        self._file.write(values.tobytes())
        largest = np.abs(values.astype(float)).max(0)
        self.is_finite = self.is_finite and bool(np.isfinite(largest).all())
        self.largest = np.maximum(self.largest, largest)
        self.is_whole &= (np.round(values) == values).all(0)

    @property
    def is_empty(self) -> bool:
        """Return True without a sample."""
        return not self._blocks

    @property
    def stamps(self) -> Samples:
        """Stamps as received [s]."""
        return np.concatenate([stamps for _, _, stamps in self._blocks])

    @property
    def connection(self) -> np.ndarray:
        """Connection of each sample."""
        return np.repeat([number for _, number, _ in self._blocks], self._counts)

    @property
    def received(self) -> Samples:
        """CLOCK_MONOTONIC of the arrival of each sample [s]."""
        return np.repeat([at for at, _, _ in self._blocks], self._counts)

    @property
    def _counts(self) -> list[int]:
        return [len(stamps) for _, _, stamps in self._blocks]

    def values(self) -> np.ndarray:
        """Return all values (sample, channel), read from the file when they are used."""
        self._file.flush()
        shape = (sum(self._counts), self._channels)
        return np.memmap(self._file, self._type or float, "r", 0, shape)

    def blocks(self) -> Iterator[StreamBlock]:
        """Yield the blocks again."""
        values, first = self.values(), 0
        for received, connection, stamps in self._blocks:
            yield StreamBlock(received, connection, stamps, values[first : first + len(stamps)])
            first += len(stamps)
