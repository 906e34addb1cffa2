"""Windows on the clock of another device: what is made of EMG, EEG or heart beats is their tools' work, not ours."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from exograv.recording.device_stream import DeviceStream

from .recordings import Window


@dataclass(frozen=True)
class StampedWindow:
    """A window by the stamps of a stream, as received [s]."""

    window: int
    attempt: int
    connection: int
    """Of the stream; each may have a clock of its own."""

    opened: float
    closed: float


def windows_on_stream(stream: DeviceStream, windows: Sequence[Window]) -> list[StampedWindow]:
    """The windows that one connection of a stream spans; others are left out, as nobody can say where they would be."""
    found = []
    for number in np.unique(stream.connection):
        of = (stream.connection == number) & np.isfinite(stream.t)
        t, stamps = stream.t[of], stream.stamps[of]
        for window in windows:
            if len(t) and t[0] <= window.opened_s and window.closed_s <= t[-1]:
                opened, closed = np.interp((window.opened_s, window.closed_s), t, stamps)
                found.append(StampedWindow(window.window, window.attempt, int(number), float(opened), float(closed)))
    return found
