"""True segments of one wearer's arm, drawn about the regressions until they are physically possible."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.rig.twin.disturbances.levels import Disturbances
from exograv.rig.twin.disturbances.streams import stream, uniform

from .regressions import LENGTH_RESIDUAL_SD, SAMPLE, SEGMENTS, TABLE, SegmentRows, Sex

MAX_DRAWS = 10_000


@dataclass(frozen=True)
class Body:
    """Sex, height and mass of a person."""

    sex: Sex
    height: float
    """Height of the person [m]."""

    mass: float
    """Mass of the whole body [kg]."""


@dataclass(frozen=True)
class Segment:
    """Rigid segment in a frame at its proximal joint centre: x forward, y left, z up while the arm hangs straight."""

    length: float
    """Length from proximal to distal joint centre; for the hand, from wrist to fingertip [m]."""

    mass: float
    """Mass of the segment [kg]."""

    com: Float[np.ndarray, " 3"]
    """Centre of mass [m]."""

    inertia: Float[np.ndarray, "3 3"]
    """Inertia about the centre of mass [kg·m²]."""


def draw_body(seed: int) -> Body:
    """Draw a person of either sex, with equal probability.

    Men 1.78 ± 0.07 m, 80 ± 12 kg; women 1.63 ± 0.064 m, 68 ± 11 kg; both 45 to 95 kg.
    """
    generator = stream(seed, "wearer", "body")
    sex: Sex = "male" if generator.random() < 0.5 else "female"
    (height, height_sd), (mass, mass_sd) = (
        ((1.78, 0.07), (80.0, 12.0)) if sex == "male" else ((1.63, 0.064), (68.0, 11.0))
    )
    drawn_height = generator.normal(height, height_sd)
    while True:
        drawn_mass = generator.normal(mass, mass_sd)
        if 45.0 <= drawn_mass <= 95.0:
            return Body(sex, float(drawn_height), float(drawn_mass))


def draw_segments(body: Body, disturbances: Disturbances, seed: int) -> Mapping[str, Segment]:
    """Draw upper arm, forearm and hand of one person.

    Raises:
        ConfigError: No physically possible segment belongs to this body.
    """
    return {name: _draw_segment(name, body, disturbances, seed) for name in SEGMENTS}


def is_physical(mass: float, inertia: Float[np.ndarray, "3 3"]) -> bool:
    """Return True if a distribution of positive mass can have this mass and inertia about its centre."""
    moments = np.linalg.eigvalsh(inertia)  # ascending
    return bool(mass > 0.0 and moments[0] > 0.0 and moments[2] < moments[0] + moments[1])


def _draw_segment(name: str, body: Body, disturbances: Disturbances, seed: int) -> Segment:
    rows = TABLE[body.sex][name]
    generator = stream(seed, "wearer", f"segment {name}")
    stretch = body.height / SAMPLE[body.sex].height
    mean_length = rows.length * stretch
    length = mean_length + LENGTH_RESIDUAL_SD[name] * generator.standard_normal()
    study_sd = uniform(generator, disturbances.value("between_study", "sd"))
    study_factor = float(np.exp(study_sd * generator.standard_normal()))
    off_axis = 1e-3 * uniform(generator, disturbances.value("centre_off_axis", "sd_mm")) * generator.standard_normal(2)
    residual_share = uniform(generator, disturbances.value("segment_residual", "share"))
    for _ in range(MAX_DRAWS):
        residuals = generator.standard_normal(5) * np.array(
            [residual_share, residual_share, *(3 * [residual_share > 0])]
        )
        mass = study_factor * _drawn(rows, "mass", body, residuals[0])
        moments = [
            row.mean(body.mass, body.height) + row.sigma * e for row, e in zip(rows.moments, residuals[2:], strict=True)
        ]
        inertia = study_factor * 1e-4 * np.diag(moments)  # kg·cm² to kg·m²
        if is_physical(mass, inertia):
            below = _centre_below_joint(rows, body, residuals[1], stretch) * length / mean_length
            return Segment(float(length), float(mass), np.array([*off_axis, -below]), inertia)
    raise ConfigError(
        f"No physically possible {name} for a {body.sex} of {body.height:.2f} m and {body.mass:.0f} kg in {MAX_DRAWS} "
        "draws: the body is outside the regressions. Choose a body nearer to their sample (1.5-2.0 m, 45-95 kg)."
    )


def _drawn(rows: SegmentRows, quantity: str, body: Body, residual: float) -> float:
    row = getattr(rows, quantity)
    return row.mean(body.mass, body.height) + row.sigma * residual


def _centre_below_joint(rows: SegmentRows, body: Body, residual: float, stretch: float) -> float:
    """Distance [m] of the centre of mass below the proximal joint centre, in a segment of mean length for the stature.

    The regressions count from the distal landmark. A segment that is longer than the mean is stretched as a whole
    later.
    """
    from_distal = 0.01 * _drawn(rows, "centre", body, residual)  # men: cm to m; women: % to fraction
    if body.sex == "female":
        from_distal *= rows.landmark_length * stretch
    return (rows.length + rows.distal_gap) * stretch - from_distal
