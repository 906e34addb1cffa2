"""Anthropometric table of an arm from height, mass and sex, with its uncertainty: the estimator's prior.

Source: de Leva 1996, doi 10.1016/0021-9290(95)00178-6. Reasons for the prior: docs/explanation/arm.md.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError

from .tree import inertial_parameters

Sex = Literal["male", "female"]


@dataclass(frozen=True)
class SegmentRow:
    """Row of the table, for one segment."""

    length_mm: float
    mass_percent: float
    """Segment mass in % of body mass."""

    com_percent: float
    """Distance of the centre of mass from the proximal joint centre, in % of length."""

    gyration_percent: tuple[float, float, float]
    """Radii of gyration in % of length about the antero-posterior, medio-lateral and long axis."""


# End points: shoulder to elbow centre, elbow to wrist centre, wrist centre to tip of the third finger.
TABLE: dict[Sex, dict[str, SegmentRow]] = {
    "male": {
        "upper_arm": SegmentRow(281.7, 2.71, 57.72, (28.5, 26.9, 15.8)),
        "forearm": SegmentRow(268.9, 1.62, 45.74, (27.6, 26.5, 12.1)),
        "hand": SegmentRow(187.9, 0.61, 36.24, (28.8, 23.5, 18.4)),
    },
    "female": {
        "upper_arm": SegmentRow(275.1, 2.55, 57.54, (27.8, 26.0, 14.8)),
        "forearm": SegmentRow(264.3, 1.38, 45.59, (26.1, 25.7, 9.4)),
        "hand": SegmentRow(170.1, 0.56, 34.27, (24.4, 20.8, 15.4)),
    },
}
SAMPLE_STATURE_M: dict[Sex, float] = {"male": 1.741, "female": 1.735}  # of the table's people

# Standard deviations of a person around the table: chosen to cover the spread between studies
# (docs/explanation/arm.md).
MASS_SD = {"upper_arm": 0.15, "forearm": 0.12, "hand": 0.20}  # share
COM_ALONG_SD = 0.06  # share of segment length
COM_ACROSS_SD_M = 0.015
INERTIA_SD = 0.25  # of the logarithm of the moments about the centre
PRODUCT_SD = 0.10  # products of inertia, share of the mean moment: the table has none, but real segments do


@dataclass(frozen=True)
class Body:
    """Body data of a person, from scale, tape measure and form."""

    height_m: float
    mass_kg: float
    sex: Sex
    lengths_m: dict[str, float] | None = None
    """Measured lengths: upper_arm (shoulder to elbow centre), forearm (elbow to wrist), hand (wrist to finger tip)."""

    def __post_init__(self):
        # Ranges of safety.md F25: outside them a unit is wrong or a digit was mistyped.
        if not 1.2 <= self.height_m <= 2.2:
            raise ConfigError(f"height is {self.height_m} m; allowed: 1.2 to 2.2 m. Was it given in cm or feet?")
        if not 30.0 <= self.mass_kg <= 200.0:
            raise ConfigError(f"body mass is {self.mass_kg} kg; allowed: 30 to 200 kg. Was it given in pounds or g?")
        if self.sex not in TABLE:
            raise ConfigError(f"sex is '{self.sex}'; the table of the body has: {', '.join(TABLE)}.")
        bmi = self.mass_kg / self.height_m**2
        if not 14.0 <= bmi <= 50.0:
            raise ConfigError(
                f"height {self.height_m} m and mass {self.mass_kg} kg give a body-mass index of {bmi:.1f}; allowed: "
                "14 to 50. Check both units."
            )
        for name, length in (self.lengths_m or {}).items():
            if name not in MASS_SD:
                raise ConfigError(f"No segment '{name}'. Segments: {', '.join(MASS_SD)}.")
            if not 0.05 <= length <= 0.5:
                raise ConfigError(f"length of {name} is {length} m; allowed: 0.05 to 0.5 m. Was it given in cm?")


def segment_lengths(body: Body) -> dict[str, float]:
    """Lengths [m] of upper arm, forearm and hand: measured if given, otherwise the table's, scaled with stature."""
    scale = body.height_m / SAMPLE_STATURE_M[body.sex]
    table = {name: scale * row.length_mm / 1000.0 for name, row in TABLE[body.sex].items()}
    return {**table, **(body.lengths_m or {})}


def segment_parameters(body: Body, name: str, deviation: Float[np.ndarray, " 10"]) -> Float[np.ndarray, " 10"]:
    """Inertial parameters (10,) of a segment about its proximal joint centre, x forward, y left, z up when hanging.

    Args:
        body: Body data of the person.
        name: upper_arm, forearm or hand.
        deviation: Deviation from the table in standard deviations: mass, centre (x, y, z), logarithm of the three
            moments about the centre, three products (xy, xz, yz).
    """
    row, length = TABLE[body.sex][name], segment_lengths(body)[name]
    mass = body.mass_kg * row.mass_percent / 100.0 * (1.0 + MASS_SD[name] * deviation[0])
    com = np.array([0.0, 0.0, -length * row.com_percent / 100.0])
    com += deviation[1:4] * np.array([COM_ACROSS_SD_M, COM_ACROSS_SD_M, COM_ALONG_SD * length])
    moments = mass * (np.array(row.gyration_percent) / 100.0 * length) ** 2 * np.exp(INERTIA_SD * deviation[4:7])
    inertia = np.diag(moments)
    products = PRODUCT_SD * moments.mean() * deviation[7:]
    for (i, j), product in zip([(0, 1), (0, 2), (1, 2)], products, strict=True):
        inertia[i, j] = inertia[j, i] = product
    return inertial_parameters(mass, com, inertia)


def segment_prior(body: Body, name: str) -> tuple[Float[np.ndarray, " 10"], Float[np.ndarray, "10 10"]]:
    """Return mean and covariance (by finite differences) of the inertial parameters of a segment."""
    step = 1e-4  # of a standard deviation: small against curvature, large against rounding
    mean = segment_parameters(body, name, np.zeros(10))
    jacobian = np.column_stack(
        [
            (segment_parameters(body, name, step * e) - segment_parameters(body, name, -step * e)) / (2 * step)
            for e in np.eye(10)
        ]
    )
    return mean, jacobian @ jacobian.T
