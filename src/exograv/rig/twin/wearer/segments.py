"""True segments of one wearer's arm, drawn about the regressions until they are physically possible."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.rig.twin.disturbances.levels import Disturbances
from exograv.rig.twin.disturbances.streams import stream, uniform

from .dumas_sample import DUMAS, STATURE
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
    """Draw upper arm, forearm and hand of one person's right arm; the world chooses the anthropometric sample.

    Raises:
        ConfigError: No physically possible segment belongs to this body.
    """
    draw = _draw_dumas_segment if disturbances.world == "bodies" else _draw_segment
    return {name: draw(name, body, disturbances, seed) for name in SEGMENTS}


def mirrored(segment: Segment) -> Segment:
    """Return the same segment of the other arm."""
    mirror = np.diag([1.0, -1.0, 1.0])
    return replace(segment, com=mirror @ segment.com, inertia=mirror @ segment.inertia @ mirror)


def is_physical(mass: float, inertia: Float[np.ndarray, "3 3"]) -> bool:
    """Return True if a distribution of positive mass can have this mass and inertia about its centre."""
    moments = np.linalg.eigvalsh(inertia)  # ascending
    return bool(mass > 0.0 and moments[0] > 0.0 and moments[2] < moments[0] + moments[1])


@dataclass(frozen=True)
class _Individual:
    """Differences of one person's segment from the mean of a sample, the same in every sample."""

    generator: np.random.Generator
    """Generator of the segment, behind the draws below."""

    longer: float
    """Length minus the mean length at this stature [m]."""

    study_factor: float
    """Factor on mass and inertia between studies [-]."""

    off_axis: Float[np.ndarray, " 2"]
    """Displacement of the centre of mass, forward and left [m]."""

    residual_share: float
    """Size of the residuals over their SD [-]."""


def _draw_individual(name: str, disturbances: Disturbances, seed: int) -> _Individual:
    generator = stream(seed, "wearer", f"segment {name}")
    longer = LENGTH_RESIDUAL_SD[name] * generator.standard_normal()
    study_sd = uniform(generator, disturbances.value("between_study", "sd"))
    study_factor = float(np.exp(study_sd * generator.standard_normal()))
    off_axis = 1e-3 * uniform(generator, disturbances.value("centre_off_axis", "sd_mm")) * generator.standard_normal(2)
    share = uniform(generator, disturbances.value("segment_residual", "share"))
    return _Individual(generator, float(longer), study_factor, off_axis, share)


def _draw_dumas_segment(name: str, body: Body, disturbances: Disturbances, seed: int) -> Segment:
    """Draw a segment about the second sample. The table prints no spread: it is that of the regressions, relative."""
    row, rows, sample = DUMAS[body.sex][name], TABLE[body.sex][name], SAMPLE[body.sex]
    drawn = _draw_individual(name, disturbances, seed)
    length = row.length * body.height / STATURE[body.sex] + drawn.longer
    of_mass, of_centre, of_inertia = drawn.residual_share * drawn.generator.standard_normal(3)
    # Factors instead of sums: whatever the residual, the segment stays physically possible.
    mass_sd, inertia_sd = (one.sigma / one.mean(sample.mass, sample.height) for one in (rows.mass, rows.moments[0]))
    mass = drawn.study_factor * 0.01 * row.mass_percent * body.mass * float(np.exp(mass_sd * of_mass))
    centre_sd = 0.01 * rows.centre.sigma * (rows.landmark_length if body.sex == "female" else 1.0) / rows.length
    centre = length * (row.centre + np.array([0.0, 0.0, centre_sd * of_centre]))
    inertia = mass * length**2 * float(np.exp(inertia_sd * of_inertia)) * row.inertia
    return Segment(length, mass, centre + np.array([*drawn.off_axis, 0.0]), inertia)


def _draw_segment(name: str, body: Body, disturbances: Disturbances, seed: int) -> Segment:
    rows = TABLE[body.sex][name]
    drawn = _draw_individual(name, disturbances, seed)
    stretch = body.height / SAMPLE[body.sex].height
    mean_length = rows.length * stretch
    length = mean_length + drawn.longer
    study_factor, share = drawn.study_factor, drawn.residual_share
    for _ in range(MAX_DRAWS):
        residuals = drawn.generator.standard_normal(5) * np.array([share, share, *(3 * [share > 0])])
        mass = study_factor * _drawn(rows, "mass", body, residuals[0])
        moments = [
            row.mean(body.mass, body.height) + row.sigma * e for row, e in zip(rows.moments, residuals[2:], strict=True)
        ]
        inertia = study_factor * 1e-4 * np.diag(moments)  # kg·cm² to kg·m²
        if is_physical(mass, inertia):
            below = _centre_below_joint(rows, body, residuals[1], stretch) * length / mean_length
            return Segment(float(length), float(mass), np.array([*drawn.off_axis, -below]), inertia)
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
