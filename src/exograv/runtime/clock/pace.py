"""Pace of a simulation in real time, for a person who watches it."""

import time


class RealTimePace:
    """Pace with absolute deadlines; a late tick does not delay the ones after it."""

    def __init__(self, period_s: float):
        self._period_s = period_s
        self._start = time.monotonic()
        self._tick = 0

    def wait(self) -> None:
        """Wait until the time of this tick."""
        self._tick += 1
        ahead = self._start + self._tick * self._period_s - time.monotonic()
        if ahead > 0.0:
            time.sleep(ahead)
