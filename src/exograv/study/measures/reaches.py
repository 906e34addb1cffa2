"""Reaches of a window, in joints or in space: measures of each touch's reach, and scatter between reaches."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import signal

from .movement import Reach, last_reach, log_dimensionless_jerk, path_length, sparc

# `sparc` uses the band below this frequency. Encoder steps and tremor above it would dominate a second derivative.
SMOOTH_HZ = 10.0
LONGEST_GAP_S = 0.2
"""Largest interval between samples of a reach; a reach with a longer gap is not measured."""

COMPARED = 101
"""Number of points of a reach, evenly spaced in time, at which reaches are compared."""


@dataclass(frozen=True)
class Motion:
    """Path over time, of joints [rad] or of a point [m]."""

    t: Float[np.ndarray, " sample"]
    path: Float[np.ndarray, "sample axis"]

    def between(self, first_s: float, last_s: float) -> "Motion | None":
        """Return the motion from `first_s` to `last_s` at equal steps; None if there is a long gap."""
        is_in = (self.t >= first_s) & (self.t <= last_s)
        t, path = self.t[is_in], self.path[is_in]
        if len(t) < 8 or max(np.diff(t).max(), t[0] - first_s, last_s - t[-1]) > LONGEST_GAP_S:
            return None
        n = round((t[-1] - t[0]) / float(np.median(np.diff(t)))) + 1
        even = np.linspace(t[0], t[-1], n)
        return Motion(even, np.column_stack([np.interp(even, t, axis) for axis in path.T]))

    @property
    def rate_Hz(self) -> float:
        """Sampling rate of a motion at equal steps."""
        return (len(self.t) - 1) / float(self.t[-1] - self.t[0])


@dataclass(frozen=True)
class MeasuredReach:
    """Measures of one reach."""

    movement_s: float
    length: float
    peak_speed: float
    sparc: float
    ldlj: float
    course: Float[np.ndarray, "point axis"]
    """Positions at the relative times `COMPARED`, from the beginning of the reach to the touch."""


def reaches(motion: Motion, opened_s: float, touches_s: Sequence[float]) -> Iterator[MeasuredReach | None]:
    """Yield the reach of each touch in order, which begins after the touch before or the opening of the window."""
    before = opened_s
    for touch_s in touches_s:
        stretch = motion.between(before, touch_s)
        yield None if stretch is None else _measured(stretch, touch_s)
        before = touch_s


def _measured(stretch: Motion, touch_s: float) -> MeasuredReach | None:
    velocity = smoothed_velocity(stretch)
    speed = np.linalg.norm(velocity, axis=1)
    found = last_reach(stretch.path, speed)
    if found is None:
        return None
    part = slice(found.first, found.last + 1)
    return MeasuredReach(
        movement_s=touch_s - float(stretch.t[found.first]),
        length=path_length(stretch.path[part]),
        peak_speed=float(speed[part].max()),
        sparc=sparc(speed[part], stretch.rate_Hz),
        ldlj=log_dimensionless_jerk(velocity[part], stretch.rate_Hz),
        course=_course(stretch.path, found),
    )


def smoothed_velocity(motion: Motion) -> Float[np.ndarray, "sample axis"]:
    """Velocity per second, low-pass filtered at `SMOOTH_HZ` if the motion is sampled fast enough."""
    velocity = np.gradient(motion.path, 1.0 / motion.rate_Hz, axis=0)
    if motion.rate_Hz <= 2.5 * SMOOTH_HZ:  # A signal sampled at 20 Hz holds nothing above 10 Hz.
        return velocity
    low_pass = signal.butter(2, SMOOTH_HZ, fs=motion.rate_Hz, output="sos")
    return signal.sosfiltfilt(low_pass, velocity, axis=0, padlen=min(len(velocity) - 1, round(0.2 * motion.rate_Hz)))


def _course(path: Float[np.ndarray, "sample axis"], reach: Reach) -> Float[np.ndarray, "point axis"]:
    at = np.linspace(reach.first, reach.last, COMPARED)
    return np.column_stack([np.interp(at, np.arange(len(path)), axis) for axis in path.T])


def scatter_about_mean(courses: Float[np.ndarray, "reach point axis"]) -> tuple[float, float]:
    """Scatter of reaches: at their ends (root of summed variances), and root mean square over their course."""
    if len(courses) < 3:
        return np.nan, np.nan
    variance = courses.var(0, ddof=1).sum(1)
    return float(np.sqrt(variance[-1])), float(np.sqrt(variance.mean()))
