"""The recorder's side of other devices: from their ring into the file, each block once, whoever is replaced."""

import numpy as np

from exograv.recording import RecordingWriter

from .blocks import CORRECTED, CORRECTION_ROW, TAKEN_MAX, RecordedDevices


class BlockIntake:
    """Takes blocks, and knows how the rig's clock is ahead of CLOCK_MONOTONIC."""

    def __init__(self, devices: RecordedDevices, writer: RecordingWriter, has_rig: bool):
        """Go on after what the writer's file holds.

        Args:
            devices: Whose blocks they are.
            writer: Of the file.
            has_rig: Whether ticks will come; without, the file's clock is CLOCK_MONOTONIC.
        """
        self._topics = [stream.topic for stream in devices.streams]
        self._writer = writer
        # What the file holds already is not taken again.
        ring = devices.blocks()
        ring.acknowledge(self._written())
        ring.close()
        self._ring = devices.blocks()
        self._ahead_s = None if has_rig else 0.0

    def see(self, ticks: np.ndarray) -> None:
        """Learn from ticks (tick,) how the two clocks of the rig stand to each other."""
        ticks = ticks[np.isfinite(ticks["monotonic"])]
        if len(ticks):
            self._ahead_s = float(ticks["now"][-1] - ticks["monotonic"][-1])

    def rig_time(self, monotonic: float) -> float:
        """The rig's clock, by the newest tick; 0 before the first [s]."""
        return 0.0 if self._ahead_s is None else monotonic + self._ahead_s

    def take(self) -> bool:
        """Write what is new, and say whether there was anything."""
        rows = self._ring.take(TAKEN_MAX)
        for row in rows:
            topic, t = self._topics[int(row["stream"])], self.rig_time(float(row["monotonic"]))
            data = row["data"].tobytes()[: int(row["length"])]
            if row["kind"] == CORRECTED:
                correction = np.frombuffer(data, CORRECTION_ROW)[0]
                values = {name: correction[name] for name in CORRECTION_ROW.names or ()}
                self._writer.write("/correction", t, {"topic": topic, **values})
            else:
                self._writer.write_block(topic, t, data)
        return bool(len(rows))

    def acknowledge(self) -> None:
        """Say that all that was taken is on the disk."""
        self._ring.acknowledge(self._written())

    def close(self) -> None:
        """Let go of the memory."""
        self._ring.close()

    def _written(self) -> int:
        return sum(self._writer.count(topic) for topic in ("/correction", *self._topics))
