"""At the pace of life: the simulation waits for the wall clock, to be watched."""

import time


class RealTimePace:
    """Sleeps to absolute deadlines; a late tick does not delay the ones after it."""

    def __init__(self, period_s: float):
        self._period_s = period_s
        self._start = time.monotonic()
        self._tick = 0

    def wait(self) -> None:
        """Return when this tick's time has come."""
        self._tick += 1
        ahead = self._start + self._tick * self._period_s - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
