"""Regressions of arm segments on body mass and height for the twin; never the table of the estimator's prior.

    y = b0 + b1 * mass [kg] + b2 * height [cm] + sigma * N(0, 1)

Source: Zatsiorsky–Seluyanov, men 100, women 15, as in Zatsiorsky (2002), Kinetics of Human Motion, tables A2.6 and
A2.7. The files state neither units nor the end that a centre is measured from; both are inferred: at 73 kg, 174.1 cm
the men's rows give 13.3, 14.3, 11.8 cm, and the sample means 55.02, 57.26, 63.09 % of the segments from the distal end
are 13.4, 14.4, 12.0 cm. The women's rows miss the means of their own sample and are rescaled to them.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

Sex = Literal["male", "female"]
SEGMENTS = ("upper_arm", "forearm", "hand")


@dataclass(frozen=True)
class Regression:
    """Regression coefficients: one row of the tables."""

    b0: float
    b1: float
    b2: float
    sigma: float
    """Residual standard deviation at known mass and height, in the unit of the row."""

    sample_mean: float | None = None
    """Mean of the sample. It is given where the row does not pass through it; the row is then rescaled to do so."""

    def mean(self, mass: float, height: float) -> float:
        """Return the expected value for a body mass [kg] and height [m], in the unit of the row."""
        value = self.b0 + self.b1 * mass + self.b2 * 100.0 * height
        if self.sample_mean is None:
            return value
        woman = SAMPLE["female"]
        return value * self.sample_mean / (self.b0 + self.b1 * woman.mass + self.b2 * 100.0 * woman.height)


@dataclass(frozen=True)
class SampleBody:
    """Mean body mass and height of the sample behind a regression."""

    mass: float
    """Mean body mass [kg]."""

    height: float
    """Mean height of the sample [m]."""


SAMPLE: Mapping[Sex, SampleBody] = {
    "male": SampleBody(mass=73.0, height=1.741),
    "female": SampleBody(mass=61.9, height=1.735),  # unverified
}


@dataclass(frozen=True)
class SegmentRows:
    """Published data about one segment for one sex."""

    mass: Regression
    """Regression of the segment's mass [kg]."""

    centre: Regression
    """Centre of mass from the distal landmark (radiale, stylion, fingertip): men [cm], women [% of landmark length]."""

    moments: tuple[Regression, Regression, Regression]
    """Moment of inertia about the centre of mass: antero-posterior, medio-lateral, longitudinal axis [kg·cm²]."""

    length: float
    """Sample mean between joint centres: shoulder-elbow, elbow-wrist, wrist-fingertip [m].

    Source: de Leva (1996), lengths only.
    """

    landmark_length: float
    """Sample mean between the landmarks, implied by the sample's moments of inertia [m]."""

    distal_gap: float
    """Distance of the distal landmark beyond the distal joint centre [m]."""


def _rows(*rows: tuple[float, ...]) -> tuple[Regression, ...]:
    return tuple(Regression(*row) for row in rows)


def _segment(
    mass: tuple[float, ...],
    centre: tuple[float, ...],
    moments: tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]],
    lengths: tuple[float, float, float],
) -> SegmentRows:
    ap, ml, si = _rows(*moments)
    return SegmentRows(Regression(*mass), Regression(*centre), (ap, ml, si), *lengths)


# The radiale lies 15.6 mm (men) or 15.2 mm (women) beyond the elbow centre, the stylion 2.0 or 1.9 mm short of the
# wrist centre.
TABLE: Mapping[Sex, Mapping[str, SegmentRows]] = {
    "male": {
        "upper_arm": _segment(
            (0.250, 0.03012, -0.0027, 0.178),
            (1.67, 0.030, 0.054, 1.4),
            ((-250.7, 1.56, 1.512, 27.6), (-232.0, 1.525, 1.343, 26.6), (-16.9, 0.662, 0.0435, 12.5)),
            (0.2817, 0.244, 0.0156),
        ),
        "forearm": _segment(
            (0.3185, 0.01445, -0.00114, 0.101),
            (0.192, -0.028, 0.093, 1.14),
            ((-64.0, 0.95, 0.34, 10.2), (-67.9, 0.855, 0.376, 9.6), (5.66, 0.306, -0.088, 2.9)),
            (0.2689, 0.251, -0.0020),
        ),
        "hand": _segment(
            (-0.1165, 0.0036, 0.00175, 0.063),
            (4.11, 0.026, 0.033, 1.12),
            ((-19.5, 0.17, 0.116, 3.7), (-13.68, 0.088, 0.092, 2.7), (-6.26, 0.0762, 0.0347, 1.8)),
            (0.1879, 0.191, 0.0),
        ),
    },
    "female": {  # fifth number: sample mean
        "upper_arm": _segment(
            (0.206, 0.0053, 0.0066, 0.21, 1.58),
            (44.96, 0.034, 0.051, 1.2, 55.99),
            ((-151.4, 0.107, 1.554, 45.3, 92.3), (-330.4, -0.461, 2.67, 25.6, 80.7), (-118.6, 1.19, 0.44, 5.3, 26.2)),
            (0.2751, 0.236, 0.0152),
        ),
        "forearm": _segment(
            (0.295, 0.009, 0.0003, 0.11, 0.86),
            (61.40, 0.096, -0.062, 1.4, 57.42),
            ((-132.1, 0.620, 0.825, 7.58, 40.9), (-138.5, 0.533, 0.887, 7.9, 39.7), (7.4, 0.21, -0.08, 1.3, 5.3)),
            (0.2643, 0.247, -0.0019),
        ),
        "hand": _segment(
            (-0.116, 0.0017, 0.002, 0.03, 0.35),
            (41.74, -0.120, 0.172, 1.9, 64.98),
            ((-5.71, 0.122, 0.035, 1.47, 6.0), (-5.79, 0.087, 0.034, 1.1, 4.4), (-2.138, 0.053, 0.0073, 0.7, 2.4)),
            (0.1701, 0.172, 0.0),
        ),
    },
}

LENGTH_RESIDUAL_SD: Mapping[str, float] = {"upper_arm": 0.0105, "forearm": 0.0111, "hand": 0.0077}
"""Residual SD of a length at known stature [m].

Source: computed from ANSUR II, 1986 women; used for both sexes.
"""
