"""Recorder's side of other devices: blocks from the ring into the file, each once, even after restarts."""

import numpy as np

from exograv.recording import RecordingWriter

from .blocks import CORRECTED, CORRECTION_ROW, DATA_BYTES, SAMPLES, TAKEN_MAX, RecordedDevices


class BlockError(Exception):
    """Block of the listener that cannot be."""


class BlockIntake:
    """Reader of blocks, with the offset of the rig's clock to CLOCK_MONOTONIC."""

    def __init__(self, devices: RecordedDevices, writer: RecordingWriter, has_rig: bool):
        """Continue after the blocks in the writer's file.

        Args:
            devices: Devices whose blocks are recorded.
            writer: Writer of the file.
            has_rig: True if ticks will come; without ticks, the file's clock is CLOCK_MONOTONIC.
        """
        self._topics = [stream.topic for stream in devices.streams]
        self._writer = writer
        # Blocks that the file already holds are not taken again.
        ring = devices.blocks()
        ring.acknowledge(self._written())
        ring.close()
        self._ring = devices.blocks()
        self._ahead_s = None if has_rig else 0.0

    def see(self, ticks: np.ndarray) -> None:
        """Update the offset between the rig's clock and CLOCK_MONOTONIC from ticks (tick,)."""
        ticks = ticks[np.isfinite(ticks["monotonic"])]
        if len(ticks):
            self._ahead_s = float(ticks["now"][-1] - ticks["monotonic"][-1])

    def rig_time(self, monotonic: float) -> float:
        """Return the time on the rig's clock by the newest tick [s]; 0 before the first tick."""
        return 0.0 if self._ahead_s is None else monotonic + self._ahead_s

    def take(self) -> bool:
        """Write all new blocks; return True if there were any.

        Raises:
            BlockError: A block has a field out of its range. Nothing of it is written.
        """
        rows = self._ring.take(TAKEN_MAX)
        for row in rows:
            stream, kind, length, monotonic = (row[name].item() for name in ("stream", "kind", "length", "monotonic"))
            data = row["data"].tobytes()[:length]
            is_whole = length == CORRECTION_ROW.itemsize if kind == CORRECTED else 0 < length <= DATA_BYTES
            if stream >= len(self._topics) or kind not in (SAMPLES, CORRECTED) or not is_whole:
                raise BlockError(f"stream {stream}, kind {kind}, {length} bytes")
            topic, t = self._topics[stream], self.rig_time(monotonic)
            if kind == CORRECTED:
                correction = np.frombuffer(data, CORRECTION_ROW)[0]
                values = {name: correction[name] for name in CORRECTION_ROW.names or ()}
                if not np.isfinite(list(values.values())).all():
                    raise BlockError(f"a clock correction of {topic} that is not finite")
                self._writer.write("/correction", t, {"topic": topic, **values})
            else:
                self._writer.write_block(topic, t, data)
        return bool(len(rows))

    def acknowledge(self) -> None:
        """Acknowledge that all blocks taken so far are on the disk."""
        self._ring.acknowledge(self._written())

    def close(self) -> None:
        """Release the shared memory."""
        self._ring.close()

    def _written(self) -> int:
        return sum(self._writer.count(topic) for topic in ("/correction", *self._topics))
