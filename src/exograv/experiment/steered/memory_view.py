"""View of the shared memory of a flight's processes, read beside the recorder."""

import threading
from collections import deque

import numpy as np

from exograv.runtime.recorder.recorder_process import PHASE, Inlet
from exograv.safety.guard import SafeState
from exograv.safety.modes import Mode
from exograv.safety.stops import StopReason

from .view_models import Lateness, PlotTrace, SafeStateName

PLOT_EVERY = 20
"""Number of ticks between two samples to plot: 50 Hz of a loop of 1 kHz."""

PLOTTED = 500
"""Number of stored samples: ten seconds."""

CLOCK_LOOKS = 500
"""Number of looks whose ticks keep their two clocks: ten seconds.

A touch arrives within a second, and later only after its page had lost the connection.
"""

JUDGED_TICKS = 1000
"""Number of newest ticks from which the percentiles of their lateness are computed: one second at 1 kHz."""


class FlightMemoryView:
    """Second reader of the ring buffers of one flight. Its read positions are its own: the recorder gets every tick."""

    def __init__(self, inlet: Inlet):
        """Attach to the ring buffers, from their present position on."""
        self._ticks, self._events, self._lock = inlet.ticks(), inlet.events(), threading.Lock()
        self._late: deque[float] = deque(maxlen=JUDGED_TICKS)
        self._plotted: deque[np.void] = deque(maxlen=PLOTTED)
        self._clocks: deque[np.ndarray] = deque(maxlen=CLOCK_LOOKS)
        self._number = self._seen = 0
        self._is_closed = False
        self.newest: np.void | None = None
        """Newest tick, a row of `tick_dtype`."""
        self.mode = Mode.OFF
        self.cause = "The machine has been stopped."
        """Reason of the last stop."""

    def look(self) -> None:
        """Read new ticks and events. Call it some ten times per second."""
        with self._lock:
            if self._is_closed:
                return
            for event in self._events.take():
                kind, text = (bytes(event[name]).decode(errors="replace") for name in ("kind", "text"))
                if kind == PHASE:
                    self.mode = Mode[text.upper()]
                elif kind == "stop":
                    self.cause = _cause(text)
            rows = self._ticks.take()
            if not len(rows):
                return
            self.newest = rows[-1]
            self._late.extend(rows["lateness_us"].tolist())
            self._clocks.append(np.column_stack([rows["monotonic"], rows["now"]])[np.isfinite(rows["monotonic"])])
            for k in range(-self._seen % PLOT_EVERY, len(rows), PLOT_EVERY):
                self._plotted.append(rows[k])
                self._number += 1
            self._seen += len(rows)

    @property
    def latch(self) -> str | None:
        """Reason of the present stop; None without a stop."""
        row = self.newest
        is_stopped = row is not None and int(row["safe_state"]) - 1 >= SafeState.DESCENT
        return self.cause if is_stopped else None

    @property
    def safe_state(self) -> SafeStateName:
        """Safe state in force."""
        row = self.newest
        state = SafeState.NONE if row is None else SafeState(int(row["safe_state"]) - 1)
        return state.name.lower()  # pyright: ignore[reportReturnType] - all of its names are there

    def lateness(self) -> Lateness | None:
        """Lateness over the last second."""
        with self._lock:
            late = np.array(self._late)
        if not len(late):
            return None
        p50, p99, most = np.percentile(late, [50, 99, 100]).round(1).tolist()
        return Lateness(p50_us=p50, p99_us=p99, max_us=most)

    def rig_time(self, monotonic: float) -> float | None:
        """Return a time of CLOCK_MONOTONIC on the rig's clock [s], by the ticks around it; None before the first tick.

        The two clocks run apart while simulated drives wait for the computer, so ticks after that time are read first.
        """
        newest = self.newest
        if newest is None or not monotonic < newest["monotonic"]:
            self.look()
        with self._lock:
            clocks = np.concatenate([np.empty((0, 2)), *self._clocks])
        if not len(clocks):
            return None
        return monotonic + float(np.interp(monotonic, clocks[:, 0], clocks[:, 1] - clocks[:, 0]))

    def trace(self, since: int) -> PlotTrace:
        """Return the stored samples from number `since` on."""
        with self._lock:
            oldest = self._number - len(self._plotted)
            first = min(max(since, oldest), self._number)
            rows = list(self._plotted)[first - oldest :]
            number = self._number
        named = {
            f"{shown}": tuple(tuple(np.nan_to_num(row[name]).round(5).tolist()) for row in rows)
            for shown, name in (
                ("q_rad", "q_measured"),
                ("tau_desired_Nm", "tau_desired"),
                ("tau_commanded_Nm", "tau_commanded"),
                ("tau_measured_Nm", "tau_measured"),
            )
        }
        return PlotTrace(first=first, next=number, t=tuple(float(row["monotonic"]) for row in rows), **named)

    def close(self) -> None:
        """Detach from the memory. The last values stay available."""
        with self._lock:
            self._is_closed = True
            self._ticks.close()
            self._events.close()


def _cause(text: str) -> str:
    """Sentence for the text by which the guard's process reports a stop. An unknown text stays as it is."""
    return next((reason.sentence for reason in StopReason if reason.value == text), text)
