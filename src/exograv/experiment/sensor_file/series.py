"""Recorded acceleration over time, its check, and the aircraft's samples that it gives."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.errors import RecordingError
from exograv.task.aircraft_line import DAY_MS, G_MAX, RATE_HZ, AircraftSample, clock_of
from exograv.task.aircraft_watch import GAP_MS, AircraftWatch
from exograv.task.events import OpenWindow
from exograv.task.task_settings import AircraftSettings

STANDARD_GRAVITY = 9.80665
"""Acceleration of 1 g [m/s²]."""

RATE_MIN_HZ = 5.0
"""Lowest rate of a usable sensor [Hz]. Its samples are then nearer than the gap that restarts the dwell."""

HIGH_SHARE, HIGH_MIN_G, MEDIAN_MAX_G = 0.9, 0.8, 3.0
"""Tenth of the samples with the largest norm: its lower limit [g]. A file with gravity has level flight or a pull-up in
it. The upper limit of the median [g] finds a wrong unit."""

UNKNOWN_TEXT = "RECORDED"
"""Announcement of a sensor that has none. The protocols give it no meaning."""


@dataclass(frozen=True)
class Series:
    """Acceleration of a sensor, in the order of time."""

    t: Float[np.ndarray, " sample"]
    """Time [s]."""

    g: Float[np.ndarray, "sample 3"]
    """Acceleration along the sensor's axes, gravity included [g]."""

    refused: int = 0
    """Rows that hold no finite sample, or none that is later than the last."""

    @property
    def gaps(self) -> int:
        """Number of gaps, in which nothing is sent."""
        return int(np.count_nonzero(np.diff(self.t) * 1e3 > GAP_MS))


def checked(t: Float[np.ndarray, " sample"], g: Float[np.ndarray, "sample 3"], refused: int = 0) -> Series:
    """Return the usable samples of a file.

    Raises:
        RecordingError: Too few samples are usable, they are too rare, or their values are no acceleration with gravity.
    """
    is_fine = np.isfinite(t) & np.isfinite(g).all(axis=1) & (np.abs(g) <= G_MAX).all(axis=1)
    latest = np.maximum.accumulate(np.where(is_fine, t, -np.inf))
    is_fine[1:] &= t[1:] > latest[:-1]
    found = Series(t[is_fine], g[is_fine], refused + int(np.count_nonzero(~is_fine)))
    if len(found.t) < 2:
        raise RecordingError(
            f"The file has {len(found.t)} usable samples of acceleration, and {found.refused} that are not finite, "
            f"beyond {G_MAX:g} g or out of order. Check --unit, --time-unit and --columns."
        )
    period = float(np.median(np.diff(found.t)))
    if period > 1.0 / RATE_MIN_HZ:
        raise RecordingError(
            f"The sensor has {1.0 / period:.3g} samples per second; at least {RATE_MIN_HZ:g} are needed. If this is "
            "wrong, correct --time-unit or --rate."
        )
    norm = np.linalg.norm(found.g, axis=1)
    if np.median(norm) > MEDIAN_MAX_G:
        raise RecordingError(
            f"The median of the acceleration is {np.median(norm):.3g} g; that of a flight is about 1. Correct --unit."
        )
    if np.quantile(norm, HIGH_SHARE) < HIGH_MIN_G:
        raise RecordingError(
            f"The acceleration hardly exceeds {np.quantile(norm, HIGH_SHARE):.2g} g: the file is without gravity "
            "('linear' or 'free' acceleration), or in another unit. Give the columns with gravity, or --unit."
        )
    return found


class Parabolas:
    """Aircraft's samples from the mean acceleration of each period of its feed.

    The number of the parabola counts the windows that the protocol's limits open.
    """

    def __init__(self, settings: AircraftSettings, level: float):
        self._watch, self._count = AircraftWatch(settings, level), 0

    def sample(self, t: float, since_midnight_ms: int, g: Float[np.ndarray, "3"]) -> AircraftSample:
        """Return the sample of the time `t` [s] with the mean acceleration `g` [g]."""
        ms, mean = since_midnight_ms % DAY_MS, (float(g[0]), float(g[1]), float(g[2]))
        # The sensor measures neither temperature nor humidity nor pressure; nothing reads these fields.
        sample = AircraftSample(ms, clock_of(ms), mean, 0.0, 0.0, 0.0, self._count, UNKNOWN_TEXT)
        self._watch, events = self._watch.with_sample(sample, t)
        self._count += sum(isinstance(event, OpenWindow) for event in events)
        return replace(sample, parabola=self._count)


def flown_samples(series: Series, settings: AircraftSettings, level: float) -> Iterator[tuple[float, AircraftSample]]:
    """Yield the time after the first sample [s], and the aircraft's sample.

    Each sample is the mean of the sensor's values in a period of the aircraft's feed, so that vibration above its rate
    does not open or close a window.
    """
    period = 1.0 / RATE_HZ
    places = np.floor((series.t - series.t[0]) / period).astype(int)
    begins = np.flatnonzero(np.diff(places, prepend=-1))
    counts = np.diff(begins, append=len(places))
    means = np.add.reduceat(series.g, begins, axis=0) / counts[:, None]
    parabolas = Parabolas(settings, level)
    for place, mean in zip(places[begins], means, strict=True):
        t = float(place) * period
        yield t, parabolas.sample(t, round(1e3 * (float(series.t[0]) + t)), mean)
