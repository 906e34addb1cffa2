"""The truth about one virtual wearer; nothing of control or identification may read it."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from exograv.model.rig_settings import ArmKind, ArmSide
from exograv.options import Side
from exograv.rig.twin.disturbances.levels import Disturbances
from exograv.rig.twin.disturbances.streams import stream, uniform

from .anatomy import ANATOMY
from .regressions import SEGMENTS
from .segments import Body, Segment, draw_body, draw_segments
from .skeleton import Skeleton, drawn_skeleton

PerFreedom = Float[np.ndarray, " freedom"]


@dataclass(frozen=True)
class Cuffs:
    """The true cuffs, all alike; z along the limb. A direction that the machine leaves free is free."""

    stiffness: Float[np.ndarray, " 6"]
    """x, y, z [N/m], then about x, y, z [N·m/rad]."""

    damping: float
    """Against relative motion [N·s/m]."""

    damping_rotation: float
    """Against relative rotation [N·m·s/rad]."""


@dataclass(frozen=True)
class PassiveJoints:
    """What the relaxed freedoms of an arm, or of both arms, do by themselves."""

    stiffness: PerFreedom
    """[N·m/rad]"""

    neutral: PerFreedom
    """[rad]"""

    damping: PerFreedom
    """[N·m·s/rad]"""

    range: Float[np.ndarray, "freedom 2"]
    """Where the joints end [rad]."""

    stop: PerFreedom
    """Torque at the end of the range; zero without end stops [N·m]."""

    hysteresis: float
    """Elastic torque that a fast motion adds and that then decays, as a share of the lasting one [-]."""


@dataclass(frozen=True)
class RestlessArm:
    """An arm whose owner was told to relax it."""

    bias_rms: PerFreedom
    """Slow muscle torque [N·m]."""

    bias_correlation: PerFreedom
    """How long it lasts [s]."""

    bursts_per_minute: float
    burst_share: PerFreedom
    """Of a burst's torque at a freedom [-]."""


@dataclass(frozen=True)
class WearerArm:
    """One arm."""

    skeleton: Skeleton
    donning_offset: Float[np.ndarray, " 3"]
    """True shoulder centre with the arm hanging, minus the machine's `shoulder_centre`, base axes [m]."""

    passive: PassiveJoints
    unrest: RestlessArm

    @property
    def side(self) -> ArmSide:
        """Right or left."""
        return self.skeleton.side


@dataclass(frozen=True)
class Wearer:
    """One person in the machine, drawn once and never changed."""

    body: Body
    arms: tuple[WearerArm, ...]
    """As many as the machine has, the right one first."""

    lengths_given: Mapping[str, float]
    """Lengths of the first arm as somebody measured them, wrongly; all that the software may know [m]."""

    glenohumeral_share: float
    """Share of the shift of the shoulder centre with elevation [-]."""

    cuffs: Cuffs

    @cached_property
    def passive(self) -> PassiveJoints:
        """Of all arms' freedoms."""
        parts = [arm.passive for arm in self.arms]
        joined = {
            name: np.concatenate([getattr(part, name) for part in parts])
            for name in ("stiffness", "neutral", "damping", "range", "stop")
        }
        return PassiveJoints(**joined, hysteresis=parts[0].hysteresis)


def draw_wearer(
    disturbances: Disturbances,
    seed: int,
    side: Side = "right",
    body: Body | None = None,
    kind: ArmKind = "shoulder_elbow",
    skeleton: Skeleton | None = None,
) -> Wearer:
    """One wearer of the population, or one of this sex, height and mass, or one whose arm is given."""
    body = body or draw_body(seed)
    skeletons = (skeleton,) if skeleton else _draw_skeletons(disturbances, seed, side, body, kind)
    lengths = skeletons[0].lengths
    generator = stream(seed, "wearer", "length_error")
    error = 1e-3 * uniform(generator, disturbances.value("length_error", "sd_mm"))
    generator.random()  # so that people of earlier recordings stay the same
    errors = {name: error * float(generator.standard_normal()) for name in SEGMENTS}
    return Wearer(
        body=body,
        arms=tuple(
            _draw_arm(disturbances, seed, owner, one)
            for owner, one in zip(("wearer", "wearer, second arm"), skeletons, strict=False)
        ),
        lengths_given={name: length + errors[name] for name, length in lengths.items()},
        glenohumeral_share=_number(disturbances, "glenohumeral_shift", "share"),
        cuffs=_cuffs(disturbances),
    )


def _draw_skeletons(
    disturbances: Disturbances, seed: int, side: Side, body: Body, kind: ArmKind
) -> tuple[Skeleton, ...]:
    segments = draw_segments(body, disturbances, seed)
    if side != "both":
        return (drawn_skeleton(segments, side, kind),)
    return (
        drawn_skeleton(segments, "right", kind),
        drawn_skeleton(_other_arm(segments, disturbances, seed), "left", kind),
    )


def _other_arm(segments: Mapping[str, Segment], disturbances: Disturbances, seed: int) -> Mapping[str, Segment]:
    """A person's other arm: the mirror image, as long, and a little lighter or heavier."""
    mirror = np.diag([1.0, -1.0, 1.0])
    generator = stream(seed, "wearer", "between_arms")
    sd = uniform(generator, disturbances.value("between_arms", "sd"))
    factors = np.exp(sd * generator.standard_normal(len(segments)))
    return {
        name: replace(
            segment,
            mass=factor * segment.mass,
            com=mirror @ segment.com,
            inertia=factor * mirror @ segment.inertia @ mirror,
        )
        for factor, (name, segment) in zip(factors.tolist(), segments.items(), strict=True)
    }


def _draw_arm(disturbances: Disturbances, seed: int, owner: str, skeleton: Skeleton) -> WearerArm:
    offset = 1e-3 * _number(disturbances, "donning_offset", "max_mm")
    return WearerArm(
        skeleton=skeleton,
        donning_offset=offset * stream(seed, owner, "donning_offset").uniform(-1.0, 1.0, 3),
        passive=_draw_passive(disturbances, seed, owner, skeleton.freedoms),
        unrest=_draw_unrest(disturbances, seed, owner, skeleton.freedoms),
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


def _draw_passive(disturbances: Disturbances, seed: int, owner: str, freedoms: tuple[str, ...]) -> PassiveJoints:
    anatomy = [ANATOMY[freedom] for freedom in freedoms]
    spread = 10.0 * stream(seed, owner, "neutral").standard_normal(len(anatomy))
    has_end_stops = _number(disturbances, "end_stops", "present") > 0.0
    return PassiveJoints(
        stiffness=_per_freedom(disturbances, "passive_stiffness", seed, owner, freedoms),
        neutral=np.deg2rad(np.array([one.neutral_deg for one in anatomy]) + spread),
        damping=_per_freedom(disturbances, "passive_damping", seed, owner, freedoms),
        range=np.deg2rad([one.range_deg for one in anatomy]),
        stop=has_end_stops * np.array([one.stop_Nm for one in anatomy]),
        hysteresis=_number(disturbances, "hysteresis", "share"),
    )


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
