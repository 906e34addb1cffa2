"""Model of the wearer's arms: freedoms and bodies scaled to the person, with the prior's uncertainty.

An arm in a machine for shoulder and elbow has four freedoms. A machine that rolls the forearm adds a fifth, and one
that moves the wrist a sixth and seventh. The arm has two bodies, with the straight hand as part of the forearm. With a
moving wrist it has three. Two arms are one tree with two roots.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from .anthropometry import Body, Sex, segment_lengths, segment_prior
from .limb import FREEDOMS as FREEDOMS
from .limb import SEGMENTS as SEGMENTS
from .limb import SHIFTS
from .limb import Limb as Limb
from .rig_settings import HAND_APART, ArmKind, ArmSide
from .tree import Frame, Joint, Tree, inertial_parameters

LIMITS = {
    "flexion": (-1.0, 3.0), "abduction": (-0.6, 2.4), "rotation": (-1.6, 1.6), "elbow": (0.0, 2.6),
    "forearm_roll": (-1.5, 1.5), "wrist_flexion": (-1.2, 1.3), "wrist_deviation": (-0.6, 0.4),
}  # fmt: skip
"""Assumed range of each freedom [rad]. It distinguishes angles from a second set, half a turn apart, with the same
posture."""

REACH_MARGIN = 0.5  # rad

ENDS_DEG = {
    "flexion": (-60.0, 180.0), "abduction": (-30.0, 180.0), "rotation": (-90.0, 70.0), "elbow": (0.0, 150.0),
    "forearm_roll": (-80.0, 80.0), "wrist_flexion": (-60.0, 70.0), "wrist_deviation": (-35.0, 25.0),
}  # fmt: skip
"""Ends of the range of each freedom [°]: clinical ranges of healthy adults from textbooks, unverified."""

COMFORT_FROM_END_DEG = 15.0
"""Distance of a relaxed joint from the end of its range [°]: assumed."""

COMFORT_DEG = {
    name: (lower + COMFORT_FROM_END_DEG * (name != "elbow"), upper - COMFORT_FROM_END_DEG)
    for name, (lower, upper) in ENDS_DEG.items()
}
"""Range in which a relaxed joint is at least `COMFORT_FROM_END_DEG` from its end [°]. The elbow may be straight: its
end is bone, and the machine's own limit lies before it."""

ELBOW_OBLIQUE_DEG: Mapping[Sex, tuple[float, float]] = {"male": (6.7, 4.9), "female": (9.2, 7.5)}
ELBOW_OBLIQUE_SD_DEG = (7.0, 5.0)
"""Angle of the elbow's axis to a right angle with forearm and upper arm, and its standard deviation [°].

Tracked elbows have a carrying angle of 11.6 ± 3.2° (men) and 16.7 ± 2.6° (women) when extended, and of -1.8° and -1.6°
at the end of flexion (Ergonomics 48:1645, 2005, abstract): half of the sum and of the difference. The deviations are
assumed: studies differ in mean and spread (9.8 ± 2.8° to 11.6° in men), the axis of Rajagopal 2016 is turned by 13°,
and no arm lies exactly along the machine's links."""

WeightPlace = Literal["hand", "forearm"]
"""Places where a person can carry a known weight."""

WEIGHT_FRAME: Mapping[WeightPlace, str] = {"hand": "hand", "forearm": "mid_forearm"}

GRIP_SHARE_OF_HAND = 0.36  # grip centre from the wrist, as the hand's centre of mass in de Leva's table


@dataclass(frozen=True)
class Arm:
    """Arm of the wearer, or both arms: tree, inertial parameters of the table and their covariance."""

    tree: Tree
    """Tree with a root at each shoulder centre, x forward, y left, z up. Each arm has four massless prismatic
    joints: three shift the shoulder centre, one lengthens the upper arm beyond its measured length."""

    limbs: tuple[Limb, ...]
    lengths: Mapping[str, float]
    """Lengths of upper arm, forearm and hand, equal on both sides [m]."""

    phi: Float[np.ndarray, " phi"]
    """Inertial parameters of all segments in order, (10,) each, about the proximal joint centre [kg, kg·m, kg·m²]."""

    phi_covariance: Float[np.ndarray, "phi phi"]
    sex: Sex

    @property
    def freedoms(self) -> tuple[str, ...]:
        """Names of the arm's freedoms z, in order."""
        return tuple(limb.prefix + name for limb in self.limbs for name in FREEDOMS[: limb.n_freedoms])

    @property
    def segments(self) -> tuple[str, ...]:
        """Names of the bodies with mass, in order."""
        return tuple(limb.prefix + name for limb in self.limbs for name in limb.bodies)

    @property
    def bodies(self) -> tuple[int, ...]:
        """Index in the tree of each segment."""
        return tuple(body for limb in self.limbs for body in limb.bodies.values())

    def elbow_axis(self, limb: Limb) -> tuple[Float[np.ndarray, " 2"], Float[np.ndarray, " 2"]]:
        """Mean and standard deviation of the elbow's axis before any motion, as in `model.loops.FIT` [-]."""
        outward = 1.0 if limb.side == "right" else -1.0
        turn, tilt = np.deg2rad(ELBOW_OBLIQUE_DEG[self.sex])
        return outward * np.sin([turn, tilt]), np.deg2rad(ELBOW_OBLIQUE_SD_DEG)

    def is_reachable(self, z: Float[np.ndarray, "*state freedom"]) -> Bool[np.ndarray, "*state"]:
        """Return True if angles [rad] lie in the range of the freedoms, with a margin."""
        lower, upper = np.array([LIMITS[name] for limb in self.limbs for name in FREEDOMS[: limb.n_freedoms]]).T
        return np.asarray(np.all((z > lower - REACH_MARGIN) & (z < upper + REACH_MARGIN), axis=-1))

    def limb(self, side: ArmSide | None) -> Limb:
        """Return the arm of a side; the only arm if `side` is None."""
        return self.limbs[0] if side is None else next(limb for limb in self.limbs if limb.side == side)


MOMENTS_MIN, MOMENTS_MAX = 0.4, 1.6
"""Plausible first moments of an arm, relative to those of the anthropometric table [-]
(docs/explanation/safety.md)."""


def is_plausible(arm: Arm, phi: Float[np.ndarray, " phi"]) -> bool:
    """Return True if the first moments of each arm are plausible for the wearer whose table made `arm`.

    The first moment of a segment is its mass times the distance of its centre of mass from its proximal joint. Only
    first moments cause gravity torque. Further parameters after those of the segments are ignored.
    """
    firsts = [np.linalg.norm(one[: arm.phi.size].reshape(-1, 10)[:, 1:4], axis=1) for one in (phi, arm.phi)]
    new, table = (one.reshape(len(arm.limbs), -1).sum(axis=1) for one in firsts)
    return bool(((new >= MOMENTS_MIN * table) & (new <= MOMENTS_MAX * table)).all())


def build_arm(body: Body, *sides: ArmSide, kind: ArmKind = "shoulder_elbow") -> Arm:
    """Build one or both arms of a person from the table."""
    limbs = tuple(Limb(side, kind, number, f"{side}_" if len(sides) > 1 else "") for number, side in enumerate(sides))
    lengths = segment_lengths(body)
    phi, covariance = _prior(body, kind, lengths)
    return _arm(limbs, lengths, np.tile(phi, len(limbs)), _block_diagonal([covariance] * len(limbs)), body.sex)


def _arm(
    limbs: tuple[Limb, ...],
    lengths: Mapping[str, float],
    phi: Float[np.ndarray, " phi"],
    covariance: Float[np.ndarray, "phi phi"],
    sex: Sex,
) -> Arm:
    joints, bodies, frames = [], [], {}
    for limb in limbs:
        joints += _joints(limb, lengths)
        bodies += limb.bodies.values()
        frames |= _frames(limb, lengths)
    masses = np.zeros((len(joints), 10))
    masses[bodies] = phi.reshape(-1, 10)
    tree = Tree("arm", tuple(joints), tuple(f"after {joint.name}" for joint in joints), masses, frames)
    return Arm(tree, limbs, lengths, phi, covariance, sex)


def _prior(
    body: Body, kind: ArmKind, lengths: Mapping[str, float]
) -> tuple[Float[np.ndarray, " phi"], Float[np.ndarray, "phi phi"]]:
    """Return mean and covariance of the inertial parameters of one arm's segments."""
    segments = [segment_prior(body, name) for name in SEGMENTS]
    if kind not in HAND_APART:
        upper_arm, (phi_forearm, covariance_forearm), (phi_hand, covariance_hand) = segments
        move = translation_of_parameters(-lengths["forearm"])
        segments = [upper_arm, (phi_forearm + move @ phi_hand, covariance_forearm + move @ covariance_hand @ move.T)]
    phis, covariances = zip(*segments, strict=True)
    return np.concatenate(phis), _block_diagonal(covariances)


def _block_diagonal(blocks: Sequence[Float[np.ndarray, "..."]]) -> Float[np.ndarray, "..."]:
    whole = np.zeros((sum(map(len, blocks)),) * 2)
    start = 0
    for block in blocks:
        whole[start : start + len(block), start : start + len(block)] = block
        start += len(block)
    return whole


def _joints(limb: Limb, lengths: Mapping[str, float]) -> list[Joint]:
    """Return the joints of one arm as a chain. Angles have the same meaning on both sides."""
    outward = 1.0 if limb.side == "right" else -1.0
    along, forward = (0.0, 0.0, outward), (0.0, -1.0, 0.0)
    # Shift of the shoulder centre: up and medial in the frontal plane (docs/explanation/arm.md; the direction is
    # unverified).
    axes = {
        "shift": (0.0, outward * np.sqrt(0.5), np.sqrt(0.5)),
        "shift_forward": (1.0, 0.0, 0.0), "shift_outward": (0.0, -outward * np.sqrt(0.5), np.sqrt(0.5)),
        "flexion": forward, "abduction": (-outward, 0.0, 0.0), "rotation": along,
        "lengthening": (0.0, 0.0, -1.0),
        "elbow": forward, "forearm_roll": along, "wrist_flexion": (outward, 0.0, 0.0), "wrist_deviation": forward,
    }  # fmt: skip
    slides = dict.fromkeys(("shift", "shift_forward", "shift_outward"), (-0.1, 0.1)) | {"lengthening": (-0.05, 0.05)}
    limits = {**slides, **LIMITS}
    below = {"lengthening": lengths["upper_arm"], "wrist_flexion": lengths["forearm"]}
    chain = []
    for i, name in enumerate(list(axes)[: limb.n_freedoms + SHIFTS + 1]):
        kind = "prismatic" if name in slides else "revolute"
        origin = np.array([0.0, 0.0, -below.get(name, 0.0)])
        parent = limb.root + i - 1 if i else -1
        chain.append(
            Joint(
                f"{limb.prefix}arm_{name}",
                kind,
                parent,
                np.eye(3),
                origin,
                np.array(axes[name]),
                *limits[name],
                np.inf,
                np.inf,
            )
        )
    return chain


def _frames(limb: Limb, lengths: Mapping[str, float]) -> dict[str, Frame]:
    """Frames of the segments, middle of the forearm, wrist, middle of the grip ("hand") and finger tip."""
    forearm, below = limb.bodies["forearm"], lengths["forearm"]
    last, from_last = (limb.bodies["hand"], 0.0) if "hand" in limb.bodies else (forearm, below)
    grip = from_last + GRIP_SHARE_OF_HAND * lengths["hand"]
    half = 0.5 * below
    places = {
        "upper_arm": (limb.bodies["upper_arm"], 0.0), "forearm": (forearm, 0.0), "wrist": (forearm, below),
        "mid_forearm": (forearm, half), "hand": (last, grip), "finger_tip": (last, from_last + lengths["hand"]),
    }  # fmt: skip
    return {limb.prefix + name: Frame(body, np.eye(3), np.array([0.0, 0.0, -z])) for name, (body, z) in places.items()}


def held_weight(
    arm: Arm, mass: float, limb: int = 0, at: WeightPlace = "hand", farther_m: float = 0.0
) -> Float[np.ndarray, " phi"]:
    """Change of the arm's parameters by a point mass.

    Args:
        arm: Arm or arms of the wearer.
        mass: Point mass [kg].
        limb: Number of the arm that carries the mass.
        at: Middle of the grip, or middle of the forearm.
        farther_m: Distance of the mass beyond that place, away from the shoulder along the limb [m].
    """
    frame = arm.tree.frame(arm.limbs[limb].prefix + WEIGHT_FRAME[at])
    added = np.zeros((len(arm.segments), 10))
    place = frame.p_body_frame - np.array([0.0, 0.0, farther_m])
    added[arm.bodies.index(frame.body)] = inertial_parameters(mass, place, np.zeros((3, 3)))
    return added.ravel()


def summed_weights(arm: Arm, weights: Mapping[WeightPlace, float]) -> Float[np.ndarray, " phi"] | None:
    """Change of the arm's parameters by weights at these places [kg]; None without a weight."""
    each = [held_weight(arm, mass, at=place) for place, mass in weights.items()]
    return np.sum(each, axis=0) if each else None


def translation_of_parameters(z: float) -> Float[np.ndarray, "10 10"]:
    """Matrix (10, 10) from inertial parameters about the point (0, 0, z) [m] to those about the origin."""
    move = np.eye(10)
    move[3, 0] = z
    # I_origin = I_point + 2·z·m·c_z·1 − z·(e_z hᵀ + h e_zᵀ) + m·z²·(1 − e_z e_zᵀ), h = m·c about the point.
    xx, yy, xz, yz = 4, 6, 7, 8
    move[[xx, yy], 0] = z**2
    move[[xx, yy], 3] = 2.0 * z
    move[xz, 1] = -z
    move[yz, 2] = -z
    return move
