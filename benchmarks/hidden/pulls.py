"""Operator who pulls and pushes a hidden machine by hand, and the six-axis force sensor between hand and machine.

The sensor has no mass: that of a real one and of its handle would belong to the machine and to the measured wrench.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .draw import Hidden, Stream, Wrench

FORCE_N = 10.0, 40.0
"""Least and largest force of the operator."""
SLOWEST_HZ, FASTEST_HZ, WAVES = 0.03, 0.5, 5
"""Band of the sums of sines behind size and direction of the force, and the number of waves in each."""
HANDLE_M = 0.06
"""Distance of the handle from the mount."""
TWIST_NM = 0.4
"""Largest moment of the hand about each axis, beside that of the force at the handle."""
FADE_S = 3.0
"""Time in which the force rises at the start and falls at the end."""


@dataclass(frozen=True)
class Slow:
    """Sums of sines between -1 and 1, one per column."""

    omega: Float[np.ndarray, "wave column"]
    phase: Float[np.ndarray, "wave column"]
    size: Float[np.ndarray, "wave column"]

    @classmethod
    def drawn(cls, rng: np.random.Generator, columns: int) -> "Slow":
        """Draw frequencies, phases and sizes."""
        shape = WAVES, columns
        omega = 2.0 * np.pi * np.exp(rng.uniform(np.log(SLOWEST_HZ), np.log(FASTEST_HZ), shape))
        size = rng.uniform(0.3, 1.0, shape) / np.sqrt(omega)
        return cls(omega, rng.uniform(0.0, 2.0 * np.pi, shape), size / size.sum(axis=0))

    def at(self, t: float) -> Float[np.ndarray, " column"]:
        """Return the values at a time [s]."""
        return np.sum(self.size * np.sin(self.omega * t + self.phase), axis=0)


class Operator:
    """Hand that pulls at a handle fixed to the mount, with a force whose direction in the base changes slowly."""

    def __init__(self, rng: np.random.Generator, start_s: float, seconds: float):
        """Draw a course of force and moment that starts at a time of the rig's clock [s]."""
        self._start_s, self._seconds = start_s, seconds
        self._slow = Slow.drawn(rng, 6)
        way = rng.normal(size=3)
        self._handle = HANDLE_M * way / np.linalg.norm(way)

    def wrench(self, t: float, R_base_mount: Float[np.ndarray, "3 3"]) -> Wrench:
        """Return force and moment on the machine at the mount's origin, in the mount's axes."""
        t -= self._start_s
        values = self._slow.at(t)
        azimuth, height = 2.0 * np.pi * values[0], np.clip(1.5 * values[1], -1.0, 1.0)
        level = np.sqrt(1.0 - height**2)
        size = np.mean(FORCE_N) + 0.5 * np.ptp(FORCE_N) * np.clip(1.5 * values[2], -1.0, 1.0)
        rising = np.clip(min(t, self._seconds - t) / FADE_S, 0.0, 1.0)
        fade = rising**2 * (3.0 - 2.0 * rising)
        force = fade * size * R_base_mount.T @ [level * np.cos(azimuth), level * np.sin(azimuth), height]
        moment = np.cross(self._handle, force) + fade * TWIST_NM * values[3:]
        return np.concatenate([force, moment])


class ForceSensor:
    """Force sensor at the calibration mount with its errors, one sample per tick."""

    def __init__(self, hidden: Hidden):
        """Tare the sensor."""
        self._errors = hidden.force_sensing
        self._rng = np.random.default_rng((hidden.seed, Stream.FORCE_NOISE))
        self.samples: dict[int, Wrench] = {}
        """Measured force [N] and moment [N·m] by the number of the tick."""

    def measure(self, number: int, wrench: Wrench) -> None:
        """Keep the measurement of a force and moment on the machine in the mount's axes."""
        errors = self._errors
        self.samples[number] = errors.scale * wrench + errors.bias + errors.noise * self._rng.normal(size=6)
