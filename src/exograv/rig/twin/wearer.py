"""The truth about one virtual wearer; nothing of control or identification may read it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.model.description import Side

from .levels import Disturbances
from .regressions import SEGMENTS
from .segments import Body, Segment, draw_body, draw_segments
from .streams import stream, uniform

ARM_JOINTS = ("shoulder_flexion", "shoulder_abduction", "shoulder_rotation", "elbow_flexion")
"""Freedoms of the true arm, in order; internal rotation is positive. Source of the order: Rajagopal et al. (2016)."""

NEUTRAL_DEG = np.array([20.0, 30.0, 0.0, 107.0])
"""Angles about which the relaxed joints are elastic.

20° forward, 30° of elevation, elbow 107° from straight (sign unverified).
"""

GRIP_FRACTION = 0.36
"""Centre of the grip beyond the wrist, as a fraction of the hand's length: where its centre of mass is.

Source: de Leva (1996).
"""

PerJoint = Float[np.ndarray, " 4"]


@dataclass(frozen=True)
class Cuffs:
    """The true cuffs, both alike; z along the limb."""

    stiffness: Float[np.ndarray, " 6"]
    """x, y, z [N/m], then about x, y, z [N·m/rad]."""

    damping: float
    """Against relative motion [N·s/m]."""

    damping_rotation: float
    """Against relative rotation [N·m·s/rad]."""


@dataclass(frozen=True)
class PassiveJoints:
    """What the relaxed joints of the arm do by themselves."""

    stiffness: PerJoint
    """[N·m/rad]"""

    neutral: PerJoint
    """[rad]"""

    damping: PerJoint
    """[N·m·s/rad]"""

    has_end_stops: bool
    hysteresis: float
    """Elastic torque that a fast motion adds and that then decays, as a share of the lasting one [-]."""


@dataclass(frozen=True)
class Unrest:
    """A wearer who was told to relax."""

    bias_rms: PerJoint
    """Slow muscle torque [N·m]."""

    bias_correlation: PerJoint
    """How long it lasts [s]."""

    bursts_per_minute: float


@dataclass(frozen=True)
class Wearer:
    """One person in the machine, drawn once and never changed."""

    side: Side
    body: Body
    segments: Mapping[str, Segment]
    """Upper arm, forearm, hand."""

    lengths_given: Mapping[str, float]
    """The segments' lengths as somebody measured them, wrongly; all that the software may know [m]."""

    donning_offset: Float[np.ndarray, " 3"]
    """True shoulder centre with the arm hanging, minus the machine's `shoulder_centre`, base axes [m]."""

    glenohumeral_share: float
    """Share of the shift of the shoulder centre with elevation [-]."""

    cuffs: Cuffs
    passive: PassiveJoints
    unrest: Unrest

    @property
    def grip(self) -> Float[np.ndarray, " 3"]:
        """Where a weight hangs in the hand: in the forearm's frame, on its axis [m]."""
        return np.array([0.0, 0.0, -(self.segments["forearm"].length + GRIP_FRACTION * self.segments["hand"].length)])


def draw_wearer(disturbances: Disturbances, seed: int, side: Side = "right", body: Body | None = None) -> Wearer:
    """One wearer of the population, or one of this sex, height and mass."""
    body = body or draw_body(seed)
    segments = draw_segments(body, disturbances, seed)
    generator = stream(seed, "wearer", "length_error")
    error = 1e-3 * uniform(generator, disturbances.value("length_error", "sd_mm"))
    offset = 1e-3 * uniform(generator, disturbances.value("donning_offset", "max_mm"))
    return Wearer(
        side=side,
        body=body,
        segments=segments,
        lengths_given={name: segments[name].length + error * float(generator.standard_normal()) for name in SEGMENTS},
        donning_offset=offset * stream(seed, "wearer", "donning_offset").uniform(-1.0, 1.0, 3),
        glenohumeral_share=_number(disturbances, "glenohumeral_shift", "share"),
        cuffs=_cuffs(disturbances),
        passive=_draw_passive(disturbances, seed),
        unrest=_draw_unrest(disturbances, seed),
    )


# A cuff holds the limb by its surface, about 5 cm from the limb's axis. Assumed: no source for rotational damping.
CUFF_RADIUS = 0.05


def _cuffs(disturbances: Disturbances) -> Cuffs:
    along, across = (1e3 * _number(disturbances, "cuff_stiffness", column) for column in ("along", "across"))
    limb, others = np.rad2deg(
        [_number(disturbances, "cuff_rotation", column) for column in ("about_limb", "about_others")]
    )
    damping = _number(disturbances, "cuff_damping", "value")
    return Cuffs(np.array([across, across, along, others, others, limb]), damping, damping * CUFF_RADIUS**2)


def _draw_passive(disturbances: Disturbances, seed: int) -> PassiveJoints:
    neutral = NEUTRAL_DEG + 10.0 * stream(seed, "wearer", "neutral").standard_normal(4)
    return PassiveJoints(
        stiffness=_per_joint(disturbances, "passive_stiffness", seed),
        neutral=np.deg2rad(neutral),
        damping=_per_joint(disturbances, "passive_damping", seed),
        has_end_stops=_number(disturbances, "end_stops", "present") > 0.0,
        hysteresis=_number(disturbances, "hysteresis", "share"),
    )


def _draw_unrest(disturbances: Disturbances, seed: int) -> Unrest:
    return Unrest(
        bias_rms=_per_joint(disturbances, "slow_bias", seed),
        bias_correlation=stream(seed, "wearer", "bias_correlation").uniform(1.0, 5.0, 4),
        bursts_per_minute=_number(disturbances, "bursts", "rate"),
    )


def _per_joint(disturbances: Disturbances, row: str, seed: int) -> PerJoint:
    generator = stream(seed, "wearer", row)
    columns = ("shoulder", "shoulder", "shoulder", "elbow")
    return np.array([uniform(generator, disturbances.value(row, column)) for column in columns])


def _number(disturbances: Disturbances, row: str, column: str) -> float:
    value = disturbances.value(row, column)
    if isinstance(value, tuple):
        raise TypeError(f"{row}.{column} is a range {value}; it must be drawn.")
    return value
