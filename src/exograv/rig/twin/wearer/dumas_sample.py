"""Second anthropometric sample of arm segments for the twin: off-axis centres and products of inertia, women and men.

Source: Dumas, Chèze & Verriest (2007), J Biomech 40:543, with its corrigendum (40:1651), after stereophotogrammetry of
31 men (McConville et al. 1980) and 46 women (Young et al. 1983). Read in `wojtusch/HuMoD`,
SubjectParameterEstimation.m (both sexes), and against a second implementation for men; the paper itself was not read.
The hand reaches to the fingertip, as in both programs.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .regressions import Sex

AXES = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Axes of the table (x forward, y up, z to the right) in ours (x forward, y left, z up), in the anatomical position."""


@dataclass(frozen=True)
class SampleSegment:
    """Row of the table: a segment of the right arm."""

    mass_percent: float
    """Mass over that of the body [%]."""

    length: float
    """Mean length in the sample [m]."""

    centre_percent: tuple[float, float, float]
    """Centre of mass from the proximal joint centre, in the table's axes [% of length]."""

    radii_percent: tuple[int, int, int, int, int, int]
    """Radii of gyration xx, yy, zz, xy, xz, yz about the centre of mass [% of length].

    A negative radius is an imaginary one of the table: the entry of the inertia matrix is negative.
    """

    @property
    def centre(self) -> Float[np.ndarray, " 3"]:
        """Centre of mass over the length, in our axes [-]."""
        return 0.01 * AXES @ np.array(self.centre_percent)

    @property
    def inertia(self) -> Float[np.ndarray, "3 3"]:
        """Inertia about the centre of mass over mass and squared length, in our axes [-]."""
        xx, yy, zz, xy, xz, yz = (1e-4 * radius * abs(radius) for radius in self.radii_percent)
        return AXES @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ AXES.T


# The length of the women's hand is computed: 76.8 % of 71 mm to the knuckles is 32.7 % of 167 mm to the fingertip.
DUMAS: Mapping[Sex, Mapping[str, SampleSegment]] = {
    "male": {
        "upper_arm": SampleSegment(2.4, 0.271, (1.7, -45.2, -2.6), (31, 14, 32, 6, 5, 2)),
        "forearm": SampleSegment(1.7, 0.283, (1.0, -41.7, 1.4), (28, 11, 27, 3, 2, -8)),
        "hand": SampleSegment(0.6, 0.189, (3.5, -35.7, 3.2), (26, 16, 24, 9, 7, -8)),
    },
    "female": {
        "upper_arm": SampleSegment(2.2, 0.243, (-7.3, -45.4, -2.8), (33, 17, 33, 3, -5, -14)),
        "forearm": SampleSegment(1.3, 0.247, (2.1, -41.1, 1.9), (26, 14, 25, 10, 4, -13)),
        "hand": SampleSegment(0.5, 0.167, (3.3, -32.7, 2.1), (27, 18, 25, 12, 10, -12)),
    },
}

STATURE: Mapping[Sex, float] = {"male": 1.77, "female": 1.61}
"""Mean stature of the samples [m]; the women's is unverified."""
