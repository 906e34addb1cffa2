"""True parameters of one virtual wearer. Controllers and estimators must not read them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.model.rig_settings import ArmKind, ArmSide
from exograv.options import Side
from exograv.rig.twin.disturbances.levels import Disturbances
from exograv.rig.twin.disturbances.streams import stream, uniform

from .anatomy import ANATOMY
from .contact_cuffs import ContactCuffs, draw_contact_cuffs
from .curved_path import CurvedPath, draw_curved_path
from .elbow import draw_elbow, with_elbow
from .muscle_tissue import MuscleTissue, both_muscled, draw_muscle_tissue
from .regressions import SEGMENTS
from .segments import Body, Segment, draw_body, draw_segments, mirrored
from .shoulder_path import ShoulderPath, draw_shoulder_path
from .skeleton import Skeleton, drawn_skeleton
from .strained_cuffs import SoftTissue, StrainedCuffs, draw_soft_tissue, draw_strained_cuffs
from .tissue import Tissue, both, draw_tissue

OWNERS = "wearer", "wearer, second arm"
"""Owners of the random numbers of a person's arms."""

PerFreedom = Float[np.ndarray, " freedom"]


@dataclass(frozen=True)
class Cuffs:
    """True stiffness and damping of the cuffs, the same for all; z along the limb.

    Directions that the machine leaves free are free.
    """

    stiffness: Float[np.ndarray, " 6"]
    """Stiffness along x, y, z [N/m], then about x, y, z [N·m/rad]."""

    damping: float
    """Damping of relative motion [N·s/m]."""

    damping_rotation: float
    """Damping of relative rotation [N·m·s/rad]."""

    strained: StrainedCuffs | ContactCuffs | None = None
    """Law of a foreign world, for the translations; linear springs at home."""


@dataclass(frozen=True)
class PassiveJoints:
    """Passive torque parameters of the relaxed freedoms of one arm or of both arms."""

    stiffness: PerFreedom
    """Elastic stiffness [N·m/rad]."""

    neutral: PerFreedom
    """Angle of zero elastic torque [rad]."""

    damping: PerFreedom
    """Viscous damping [N·m·s/rad]."""

    range: Float[np.ndarray, "freedom 2"]
    """Lower and upper end of the joints' range [rad]."""

    stop: PerFreedom
    """Torque at the end of the range; zero without end stops [N·m]."""

    hysteresis: float
    """Elastic torque that a fast motion adds and that then decays, over the static elastic torque [-]."""

    tissue: Tissue | MuscleTissue | None = None
    """Laws of a foreign world, scaled to `stiffness` at 1 rad from `neutral`; linear springs at home."""


@dataclass(frozen=True)
class RestlessArm:
    """Involuntary muscle torque of an arm that its wearer was asked to relax."""

    bias_rms: PerFreedom
    """RMS of the slow muscle torque [N·m]."""

    bias_correlation: PerFreedom
    """Correlation time of the slow muscle torque [s]."""

    bursts_per_minute: float
    burst_share: PerFreedom
    """Share of a burst's torque at a freedom [-]."""


@dataclass(frozen=True)
class WearerArm:
    """True parameters of one arm."""

    skeleton: Skeleton
    donning_offset: Float[np.ndarray, " 3"]
    """True shoulder centre with the arm hanging, minus the machine's `shoulder_centre`, base axes [m]."""

    passive: PassiveJoints
    unrest: RestlessArm
    soft_tissue: Mapping[str, SoftTissue] = field(default_factory=dict)
    """Soft tissue of a foreign world, by the segment whose cuff holds its bone; none at home."""

    @property
    def side(self) -> ArmSide:
        """Side of the arm: right or left."""
        return self.skeleton.side


@dataclass(frozen=True)
class Wearer:
    """True parameters of one person in the machine, drawn once and never changed."""

    body: Body
    arms: tuple[WearerArm, ...]
    """Arms of the wearer, as many as the machine has, the right one first."""

    lengths_given: Mapping[str, float]
    """Lengths of the first arm as measured, with measurement errors [m]. The software may know these and no others."""

    glenohumeral_share: float
    """Share of the shift of the shoulder centre with elevation [-]."""

    cuffs: Cuffs
    shoulder_path: ShoulderPath | CurvedPath | None = None
    """Path of the shoulders' centres in a foreign world; None at home."""

    @cached_property
    def passive(self) -> PassiveJoints:
        """Passive joints of all arms' freedoms."""
        parts = [arm.passive for arm in self.arms]
        joined = {
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in ("stiffness", "neutral", "damping", "range", "stop")
        }
        return PassiveJoints(**joined, hysteresis=parts[0].hysteresis, tissue=_both([part.tissue for part in parts]))


def draw_wearer(
    disturbances: Disturbances,
    seed: int,
    side: Side = "right",
    body: Body | None = None,
    kind: ArmKind = "shoulder_elbow",
    skeleton: Skeleton | None = None,
) -> Wearer:
    """Draw a wearer of the population, or one with this sex, height and mass, or one with a given arm."""
    body = body or draw_body(seed)
    skeletons = (skeleton,) if skeleton else _draw_skeletons(disturbances, seed, side, body, kind)
    lengths = skeletons[0].lengths
    generator = stream(seed, "wearer", "length_error")
    error = 1e-3 * uniform(generator, disturbances.value("length_error", "sd_mm"))
    generator.random()  # keeps the draws of wearers in earlier recordings
    path = _draw_path(disturbances, seed)
    errors = {name: error * float(generator.standard_normal()) for name in SEGMENTS}
    return Wearer(
        body=body,
        arms=tuple(_draw_arm(disturbances, seed, owner, one) for owner, one in zip(OWNERS, skeletons, strict=False)),
        lengths_given={name: length + errors[name] for name, length in lengths.items()},
        glenohumeral_share=_number(disturbances, "glenohumeral_shift", "share") if path is None else path.share,
        cuffs=_cuffs(disturbances, seed),
        shoulder_path=path,
    )


def _draw_skeletons(
    disturbances: Disturbances, seed: int, side: Side, body: Body, kind: ArmKind
) -> tuple[Skeleton, ...]:
    segments = draw_segments(body, disturbances, seed)
    if side == "left" and disturbances.world == "bodies":
        # The sample has right arms, which are not symmetric.
        segments = {name: mirrored(segment) for name, segment in segments.items()}
    if side != "both":
        arms = (drawn_skeleton(segments, side, kind),)
    else:
        arms = (
            drawn_skeleton(segments, "right", kind),
            drawn_skeleton(_other_arm(segments, disturbances, seed), "left", kind),
        )
    return tuple(
        with_elbow(arm, draw_elbow(disturbances, seed, owner, body.sex))
        for owner, arm in zip(OWNERS, arms, strict=False)
    )


def _other_arm(segments: Mapping[str, Segment], disturbances: Disturbances, seed: int) -> Mapping[str, Segment]:
    """Return a person's second arm: the mirror image, of the same length, and a little lighter or heavier."""
    generator = stream(seed, "wearer", "between_arms")
    sd = uniform(generator, disturbances.value("between_arms", "sd"))
    factors = np.exp(sd * generator.standard_normal(len(segments)))
    return {
        name: replace(mirrored(segment), mass=factor * segment.mass, inertia=factor * mirrored(segment).inertia)
        for factor, (name, segment) in zip(factors.tolist(), segments.items(), strict=True)
    }


def _draw_arm(disturbances: Disturbances, seed: int, owner: str, skeleton: Skeleton) -> WearerArm:
    offset = 1e-3 * _number(disturbances, "donning_offset", "max_mm")
    return WearerArm(
        skeleton=skeleton,
        donning_offset=offset * stream(seed, owner, "donning_offset").uniform(-1.0, 1.0, 3),
        passive=_draw_passive(disturbances, seed, owner, skeleton.freedoms),
        unrest=_draw_unrest(disturbances, seed, owner, skeleton.freedoms),
        soft_tissue=draw_soft_tissue(seed, owner) if disturbances.is_foreign("cuffs") else {},
    )


# A cuff holds the limb by its surface, about 5 cm from the limb's axis [m]. Assumed: there is no source for rotational
# damping.
CUFF_RADIUS = 0.05


def usual_cuff_stiffness(disturbances: Disturbances) -> Float[np.ndarray, " 6"]:
    """Stiffness of the cuffs at these levels, in the form of `Cuffs.stiffness`, without a person's own factors."""
    along, across = (1e3 * _number(disturbances, "cuff_stiffness", column) for column in ("along", "across"))
    limb, others = np.rad2deg(
        [_number(disturbances, "cuff_rotation", column) for column in ("about_limb", "about_others")]
    )
    return np.array([across, across, along, others, others, limb])


def _cuffs(disturbances: Disturbances, seed: int) -> Cuffs:
    damping = _number(disturbances, "cuff_damping", "value")
    stiffness = usual_cuff_stiffness(disturbances)
    strained = _draw_strained(disturbances, seed)
    if strained is not None:
        stiffness = strained.stiffness_factor * stiffness
    return Cuffs(stiffness, damping, damping * CUFF_RADIUS**2, strained)


def _draw_passive(disturbances: Disturbances, seed: int, owner: str, freedoms: tuple[str, ...]) -> PassiveJoints:
    anatomy = [ANATOMY[freedom] for freedom in freedoms]
    spread = 10.0 * stream(seed, owner, "neutral").standard_normal(len(anatomy))
    has_end_stops = _number(disturbances, "end_stops", "present") > 0.0
    stiffness = _per_freedom(disturbances, "passive_stiffness", seed, owner, freedoms)
    neutral = np.deg2rad(np.array([one.neutral_deg for one in anatomy]) + spread)
    return PassiveJoints(
        stiffness=stiffness,
        neutral=neutral,
        damping=_per_freedom(disturbances, "passive_damping", seed, owner, freedoms),
        range=np.deg2rad([one.range_deg for one in anatomy]),
        stop=has_end_stops * np.array([one.stop_Nm for one in anatomy]),
        hysteresis=_number(disturbances, "hysteresis", "share"),
        tissue=_draw_tissue(disturbances, seed, owner, freedoms, stiffness, neutral),
    )


def _draw_tissue(
    disturbances: Disturbances,
    seed: int,
    owner: str,
    freedoms: tuple[str, ...],
    stiffness: PerFreedom,
    neutral: PerFreedom,
) -> Tissue | MuscleTissue | None:
    if disturbances.world == "unseen":
        return draw_muscle_tissue(seed, owner, freedoms, stiffness, neutral)
    return draw_tissue(seed, owner, freedoms, stiffness) if disturbances.is_foreign("tissue") else None


def _both(tissues: Sequence[Tissue | MuscleTissue | None]) -> Tissue | MuscleTissue | None:
    """Return the tissue of all arms; all have the laws of one world."""
    sprung = [tissue for tissue in tissues if isinstance(tissue, Tissue)]
    muscled = [tissue for tissue in tissues if isinstance(tissue, MuscleTissue)]
    return both(sprung) if sprung else both_muscled(muscled) if muscled else None


def _draw_path(disturbances: Disturbances, seed: int) -> ShoulderPath | CurvedPath | None:
    if disturbances.world == "unseen":
        return draw_curved_path(seed)
    return draw_shoulder_path(seed) if disturbances.is_foreign("shoulder") else None


def _draw_strained(disturbances: Disturbances, seed: int) -> StrainedCuffs | ContactCuffs | None:
    if disturbances.world == "unseen":
        return draw_contact_cuffs(seed)
    return draw_strained_cuffs(seed) if disturbances.is_foreign("cuffs") else None


def _draw_unrest(disturbances: Disturbances, seed: int, owner: str, freedoms: tuple[str, ...]) -> RestlessArm:
    return RestlessArm(
        bias_rms=_per_freedom(disturbances, "slow_bias", seed, owner, freedoms),
        bias_correlation=stream(seed, owner, "bias_correlation").uniform(1.0, 5.0, len(freedoms)),
        bursts_per_minute=_number(disturbances, "bursts", "rate"),
        burst_share=np.array([ANATOMY[freedom].burst_share for freedom in freedoms]),
    )


def _per_freedom(disturbances: Disturbances, row: str, seed: int, owner: str, freedoms: tuple[str, ...]) -> PerFreedom:
    generator = stream(seed, owner, row)
    columns = [ANATOMY[freedom].place for freedom in freedoms]
    return np.array([uniform(generator, disturbances.value(row, column)) for column in columns])


def _number(disturbances: Disturbances, row: str, column: str) -> float:
    value = disturbances.value(row, column)
    if isinstance(value, tuple):
        raise TypeError(f"{row}.{column} is a range {value}; it must be drawn.")
    return value
