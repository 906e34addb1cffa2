"""Movement of one reach: its beginning, length, speed and smoothness, for a hand in space and for joints."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

LEFT_REST = 0.9
"""Share of the largest distance from the end; a reach that is nearer has left the resting place."""

MOVING = 0.05
"""Share of the peak speed above which the hand or the joints move."""

# Spectral arc length: amplitudes below the threshold and frequencies above the limit are noise.
# Source: Balasubramanian et al. 2015, J NeuroEng Rehabil 12:112.
SPARC_LIMIT_HZ, SPARC_THRESHOLD, SPARC_PADDING = 10.0, 0.05, 4

Path = Float[np.ndarray, "sample axis"]
Speed = Float[np.ndarray, " sample"]


@dataclass(frozen=True)
class Reach:
    """Samples `first`…`last` of a path, both included."""

    first: int
    last: int


def last_reach(path: Path, speed: Speed) -> Reach | None:
    """Find the reach that ends with the last sample; None if nothing moved.

    Its beginning is searched back from the last sample that was still near the farthest place, to the sample where the
    speed was 5 % of the reach's peak. Corrections on the way belong to the reach; the way back to the resting place
    does
    not.
    """
    distance = np.linalg.norm(path - path[-1], axis=1)
    if not distance.max() > 0.0:
        return None
    left = int(np.flatnonzero(distance >= LEFT_REST * distance.max())[-1])
    slow = np.flatnonzero(speed[: left + 1] <= MOVING * speed[left:].max())
    first = int(slow[-1]) if len(slow) else 0
    return Reach(first, len(path) - 1) if len(path) - 1 > first else None


def path_length(path: Path) -> float:
    """Return the length of the path, in the path's unit."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def sparc(speed: Speed, rate_Hz: float) -> float:
    """Spectral arc length of a speed profile [-]: 0 is the smoothest; more and unequal strokes make it more negative.

        −∫ √((1/f_c)² + (dV/df)²) df,   V the amplitude spectrum over its value at 0

    up to f_c, the last frequency below the limit whose amplitude reaches the threshold. A signal sampled at 20 Hz holds
    nothing above 10 Hz: its value describes the shape of whole strokes, not tremor.
    """
    n = int(2 ** (np.ceil(np.log2(len(speed))) + SPARC_PADDING))
    amplitude = np.abs(np.fft.rfft(speed, n))
    frequency = np.fft.rfftfreq(n, 1.0 / rate_Hz)
    if not amplitude.max() > 0.0:
        return np.nan
    amplitude = amplitude / amplitude.max()
    is_low = frequency <= SPARC_LIMIT_HZ
    frequency, amplitude = frequency[is_low], amplitude[is_low]
    last = int(np.flatnonzero(amplitude >= SPARC_THRESHOLD)[-1])
    if last == 0:
        return np.nan
    step = np.diff(frequency[: last + 1]) / frequency[last]
    return -float(np.hypot(step, np.diff(amplitude[: last + 1])).sum())


def log_dimensionless_jerk(velocity: Path, rate_Hz: float) -> float:
    """Negative log of the dimensionless jerk of a velocity profile [-]; larger is smoother.

        −ln(T³ / v_peak² · ∫ |d²v/dt²|² dt)

    A straight minimum-jerk movement has −ln(720 · (8/15)²) = −5.32. Two derivatives magnify noise, so the velocity must
    be
    smoothed before.

    Source: Balasubramanian et al. 2015, J NeuroEng Rehabil 12:112, defined there for speed. Here it is computed from
    the
    velocity vector, which has no corners where the speed is 0.
    """
    peak = float(np.linalg.norm(velocity, axis=1).max())
    if len(velocity) < 5 or not peak > 0.0:
        return np.nan
    dt = 1.0 / rate_Hz
    jerk = np.diff(velocity, n=2, axis=0) / dt**2
    squared = float((jerk**2).sum()) * dt
    duration = (len(velocity) - 1) * dt
    return -float(np.log(duration**3 / peak**2 * squared)) if squared > 0.0 else np.nan
