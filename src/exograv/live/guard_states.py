"""States of the guard on their way to the recorder: a ring in shared memory, with a row every two seconds."""

import math

import numpy as np

from exograv.recording.guard_state import EVERY_S
from exograv.runtime.processes.shared_memory import MemoryPlaces
from exograv.runtime.recorder.recorder_process import Inlet, guard_dtype
from exograv.safety.record import GuardRecord
from exograv.safety.state import state_places


class GuardStates:
    """Writer of the guard's states."""

    def __init__(self, inlet: Inlet, record: GuardRecord):
        """Open the ring, and allocate the row that all ticks use."""
        self.places, self.row = state_places(record), np.zeros(1, guard_dtype(inlet.n_joints))
        self.row["size"] = len(self.places)
        self._record, self._ring, self._next = record, inlet.guards(), -math.inf

    def keep(self, now: float, t: float, persons: int) -> None:
        """Write the state after a tick, from time to time."""
        if now < self._next:
            return
        self._next = now + EVERY_S
        self.row["now"], self.row["t"], self.row["persons"] = now, t, persons
        self.row["numbers"][0, : len(self.places)] = self._record.view[self.places]
        self._ring.put(self.row[0])

    def ring_places(self) -> MemoryPlaces:
        """Return where the ring lies, for code in C."""
        return self._ring.places()

    def close(self) -> None:
        """Release the shared memory."""
        self._ring.close()
