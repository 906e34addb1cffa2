"""Path of the shoulder's centre in the unseen world: curved, polynomial in elevation, followed with inertia.

The centre moves in two directions at right angles, each by its own polynomial of the elevation ε:

    s = size · ((1 − b − c) x + b x² + c x³),   x = ε / 90°

The girdle follows as an oscillator: it overshoots below critical damping, and has two lag times above it.

Source: the girdle's angles as regressions on the arm's posture, de Groot & Brand (2001), Clin Biomech 16:735, abstract;
the ratio of girdle to arm changes along the way and from raising to lowering: Braman et al. (2009), J Shoulder Elbow
Surg 18:960, abstract. The polynomials' ranges and both times are assumed.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.streams import stream

from .shoulder_path import TURN_MAX, turned

SHIFT_AT_90 = 0.039
"""Shift of the usual shoulder at an elevation of 90° [m]. Source: as `passive.SHIFT_TABLE`."""

ACROSS_MAX = 0.02
"""Largest shift across the main direction at 90°, and largest change of it with the plane of elevation [m]. Assumed."""


@dataclass(frozen=True)
class CurvedPath:
    """Way in which both shoulders of a person move in the unseen world."""

    share: float
    """Share of the usual shift at 90° along the main direction [-]."""

    along: tuple[float, float]
    """Coefficients b and c of the polynomial along the main direction [-]."""

    across_m: float
    """Shift across the main direction at 90°, forward positive [m]."""

    across: tuple[float, float]
    """Coefficients b and c of the polynomial across the main direction [-]."""

    by_plane_m: float
    """Further shift across when the arm points forward, by the forward part of the upper arm's direction [m]."""

    turn: Float[np.ndarray, " 2"]
    """Turn of the main direction, as in `shoulder_path.ShoulderPath` [rad]."""

    lag: float
    """Mean time by which the girdle is late in a steady motion [s]."""

    damping_ratio: float
    """Damping over critical damping [-]."""

    @property
    def frequency(self) -> float:
        """Natural angular frequency [rad/s]: a steady motion is followed 2 · ratio / frequency late."""
        return 2.0 * self.damping_ratio / self.lag

    def directions(self, usual: Float[np.ndarray, " 3"]) -> tuple[Float[np.ndarray, " 3"], ...]:
        """Return the unit directions along and across the path, from the `usual` one in the frontal plane."""
        main = turned(usual, self.turn)
        forward = np.array([1.0, 0.0, 0.0])
        across = forward - (forward @ main) * main
        return main, across / np.linalg.norm(across)


def draw_curved_path(seed: int) -> CurvedPath:
    """Draw the path of both shoulders of a person. The draw does not depend on the level."""
    generator = stream(seed, "wearer", "world unseen shoulder")
    bends = [(float(generator.uniform(-0.5, 0.8)), float(generator.uniform(-0.2, 0.2))) for _ in range(2)]
    return CurvedPath(
        share=float(generator.uniform(0.3, 1.2)),
        along=bends[0],
        across_m=float(generator.uniform(-ACROSS_MAX, ACROSS_MAX)),
        across=bends[1],
        by_plane_m=float(generator.uniform(-ACROSS_MAX, ACROSS_MAX)),
        turn=generator.uniform(-TURN_MAX, TURN_MAX, 2),
        lag=float(generator.uniform(0.15, 0.5)),
        damping_ratio=float(generator.uniform(0.5, 1.5)),
    )
