"""Bases of excitation motions: free harmonics, harmonics that return along the same path, and pieces."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.linalg import null_space

from exograv.model.rig_settings import Excitation
from exograv.motion import Trajectory

Table = Float[np.ndarray, "sample shape"]
Coefficients = Float[np.ndarray, "shape joint"]


@dataclass(frozen=True)
class Basis:
    """Basis of motions q(t) = Σ shape(t) · coefficient; each shape sums a constant and harmonics of one period."""

    period_s: float

    mixing: Float[np.ndarray, "trigonometric shape"]
    """Share of 1, sin ωt, sin 2ωt, …, cos ωt, cos 2ωt, … in each shape [-]."""

    @property
    def harmonics(self) -> int:
        """Number of harmonics of the fastest shape."""
        return (len(self.mixing) - 1) // 2

    def tables(self, t: Float[np.ndarray, " sample"]) -> tuple[Table, Table, Table]:
        """Shapes and their first and second time derivatives at the times `t` [s]."""
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
        """Table of the motion; its first row is one period of the loop after the start, as in `motion.fourier`."""
        tables = self.tables(np.arange(1, round(seconds / dt) + 1) * dt)
        q, v, a = (table @ coefficients for table in tables)
        return Trajectory(q, v, a, dt)

    def series(
        self, coefficients: Coefficients
    ) -> tuple[Float[np.ndarray, " joint"], Float[np.ndarray, "harmonic joint"], Float[np.ndarray, "harmonic joint"]]:
        """Centre, sines and cosines [rad], as in the table `[excitation]` of a machine's rig file."""
        whole = self.mixing @ coefficients
        return whole[0], whole[1 : 1 + self.harmonics], whole[1 + self.harmonics :]

    def overshoot(self, samples: int) -> float:
        """Largest factor by which the motion between `samples` equidistant samples of a period exceeds them [-].

        Source: Jetter, Pfander & Zimmermann 2001, "The crest factor for trigonometric polynomials", Rev Anal Numér
        Théor Approx 30:179 (after Ehlich & Zeller 1964): max |p| ≤ max |p at samples| / cos(degree · π / samples).
        """
        return 1.0 / np.cos(np.pi * self.harmonics / samples)


def harmonic(period_s: float, harmonics: int) -> Basis:
    """Basis of all harmonics, sines and cosines: a closed path through postures."""
    return Basis(period_s, np.eye(1 + 2 * harmonics))


def forth_and_back(period_s: float, harmonics: int) -> Basis:
    """Basis of cosines: the second half of a period reverses the first; each posture is passed in both directions."""
    return Basis(period_s, np.delete(np.eye(1 + 2 * harmonics), np.arange(1, 1 + harmonics), axis=1))


def piece(seconds: float, harmonics: int) -> Basis:
    """Basis of forth-and-back motions from rest to rest, without a jump of acceleration.

    The first shape is the start posture. The other shapes and their first two derivatives vanish at both ends:
    Σ c_k = 0 with the constant, and Σ k² c_k = 0.
    """
    k = np.arange(1, harmonics + 1)
    shapes = null_space((k**2)[None, :].astype(float))
    mixing = np.zeros((1 + 2 * harmonics, 1 + shapes.shape[1]))
    mixing[0, 0] = 1.0
    mixing[0, 1:] = -shapes.sum(axis=0)
    mixing[1 + harmonics :, 1:] = shapes
    return Basis(seconds, mixing)


def excitation_block(basis: Basis, coefficients: Coefficients) -> Excitation:
    """Return the block as a rig file has it, in degrees with one decimal."""
    centre, sine, cosine = (np.rad2deg(part).round(1).tolist() for part in basis.series(coefficients))
    return Excitation(period_s=basis.period_s, source="designed", centre_deg=centre, sine_deg=sine, cosine_deg=cosine)


def excitation_text(block: Excitation) -> str:
    """Return the lines for `rig.toml`."""
    rows = "\n".join(f"{key} = {getattr(block, key)}" for key in ("period_s", "centre_deg", "sine_deg", "cosine_deg"))
    return f'[excitation]\nsource = "{block.source}"\n{rows}\n'
