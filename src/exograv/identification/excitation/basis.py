"""Motions as sums of few shapes: harmonics of a period, harmonics that come back the way they went, and pieces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import null_space

from exograv.motion import Trajectory

Table = Float[np.ndarray, "sample shape"]
Coefficients = Float[np.ndarray, "shape joint"]


@dataclass(frozen=True)
class Basis:
    """q(t) = Σ shape(t) · coefficient, each shape a sum of a constant and harmonics of one period."""

    period_s: float

    mixing: Float[np.ndarray, "trigonometric shape"]
    """Share of 1, sin ωt, sin 2ωt, …, cos ωt, cos 2ωt, … in each shape [-]."""

    @property
    def harmonics(self) -> int:
        """Of the fastest shape."""
        return (len(self.mixing) - 1) // 2

    def tables(self, t: Float[np.ndarray, " sample"]) -> tuple[Table, Table, Table]:
        """Shapes, their first and second derivative by time at the times `t` [s]."""
        omega = 2 * np.pi / self.period_s * np.arange(1, self.harmonics + 1)
        s, c = np.sin(np.outer(t, omega)), np.cos(np.outer(t, omega))
        zero = np.zeros((len(t), 1))
        rows = (
            np.hstack([zero + 1.0, s, c]),
            np.hstack([zero, c * omega, -s * omega]),
            np.hstack([zero, -s * omega**2, -c * omega**2]),
        )
        return tuple(row @ self.mixing for row in rows)  # type: ignore[return-value]  # of three, as rows

    def trajectory(self, coefficients: Coefficients, seconds: float, dt: float) -> Trajectory:
        """Table of the motion, its first row one period of the loop after the start, as in `motion.fourier`."""
        tables = self.tables(np.arange(1, round(seconds / dt) + 1) * dt)
        q, v, a = (table @ coefficients for table in tables)
        return Trajectory(q, v, a, dt)

    def series(
        self, coefficients: Coefficients
    ) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, "harmonic joint"], Float[np.ndarray, "harmonic joint"]]:
        """Centre, sines and cosines [rad], as a machine's `[excitation]` has them."""
        whole = self.mixing @ coefficients
        return whole[0], whole[1 : 1 + self.harmonics], whole[1 + self.harmonics :]

    def overshoot(self, samples: int) -> float:
        """By how much at most the motion exceeds between `samples` equidistant ones of a period [-].

        Source: Jetter, Pfander & Zimmermann 2001, "The crest factor for trigonometric polynomials", Rev Anal Numér
        Théor Approx 30:179 (after Ehlich & Zeller 1964): max |p| ≤ max |p at samples| / cos(degree · π / samples).
        """
        return 1.0 / np.cos(np.pi * self.harmonics / samples)


def harmonic(period_s: float, harmonics: int) -> Basis:
    """All harmonics, free: a loop through postures."""
    return Basis(period_s, np.eye(1 + 2 * harmonics))


def forth_and_back(period_s: float, harmonics: int) -> Basis:
    """Cosines alone: the second half of a period is the first one backwards, and every posture is passed both ways."""
    return Basis(period_s, np.delete(np.eye(1 + 2 * harmonics), np.arange(1, 1 + harmonics), axis=1))


def piece(seconds: float, harmonics: int) -> Basis:
    """Forth and back from rest to rest, without a jump of acceleration; the first shape is the posture it starts from.

    The other shapes vanish at both ends with two derivatives: Σ c_k = 0 with the constant, and Σ k² c_k = 0.
    """
    k = np.arange(1, harmonics + 1)
    shapes = null_space((k**2)[None, :].astype(float))
    mixing = np.zeros((1 + 2 * harmonics, 1 + shapes.shape[1]))
    mixing[0, 0] = 1.0
    mixing[0, 1:] = -shapes.sum(axis=0)
    mixing[1 + harmonics :, 1:] = shapes
    return Basis(seconds, mixing)
