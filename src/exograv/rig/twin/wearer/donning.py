"""Changes of a wearer from one donning to the next: what a new fastening and a night change."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from exograv.rig.twin.disturbances.levels import Disturbances
from exograv.rig.twin.disturbances.streams import stream

from .skeleton import Bone
from .wearer import OWNERS, Cuffs, PassiveJoints, Wearer, WearerArm


def day_seed(seed: int, donning: int) -> int:
    """Seed of everything that is drawn anew at each donning; the first donning is 0.

    The number of the donning is the seed's second 32-bit word. All draws of the first donning stay bit-identical, and
    draws of other donnings are independent of them and of those of any other seed below 2³².
    """
    return seed + (donning << 32)


def donned_again(wearer: Wearer, disturbances: Disturbances, seed: int, donning: int) -> Wearer:
    """Return the wearer at a later donning; `wearer` is the same person at the first donning.

    The body and its measured lengths stay. The shoulder sits elsewhere, and the straps have another tension. Stiffness,
    damping and neutral angles of the joints change a little. Food, water and sleeves change the masses a little.
    """
    if donning == 0:
        return wearer
    day = day_seed(seed, donning)
    arms = tuple(_arm(arm, disturbances, day, owner) for arm, owner in zip(wearer.arms, OWNERS, strict=False))
    return replace(wearer, arms=arms, cuffs=_cuffs(wearer.cuffs, disturbances, day))


def _arm(arm: WearerArm, disturbances: Disturbances, day: int, owner: str) -> WearerArm:
    limit = 1e-3 * _number(disturbances, "donning_offset", "max_mm")
    factors = _mass_factors(arm, disturbances, day, owner)
    bones = tuple(_heavier(bone, factors[bone.segment]) for bone in arm.skeleton.bones)
    return replace(
        arm,
        skeleton=replace(arm.skeleton, bones=bones),
        donning_offset=limit * stream(day, owner, "donning_offset").uniform(-1.0, 1.0, 3),
        passive=_passive(arm.passive, disturbances, day, owner),
    )


def _mass_factors(arm: WearerArm, disturbances: Disturbances, day: int, owner: str) -> Mapping[str, float]:
    generator = stream(day, owner, "day_to_day mass")
    sd = _sd(disturbances, "mass")
    segments = dict.fromkeys(bone.segment for bone in arm.skeleton.bones)
    return {segment: float(np.exp(sd * generator.standard_normal())) for segment in segments}


def _heavier(bone: Bone, factor: float) -> Bone:
    return replace(bone, mass=factor * bone.mass, inertia=factor * bone.inertia)


def _passive(before: PassiveJoints, disturbances: Disturbances, day: int, owner: str) -> PassiveJoints:
    generator, count = stream(day, owner, "day_to_day elasticity"), len(before.neutral)
    stiffer, damped = np.exp(_sd(disturbances, "elasticity") * generator.standard_normal((2, count)))
    moved = np.deg2rad(_sd(disturbances, "neutral_deg")) * generator.standard_normal(count)
    return replace(
        before,
        stiffness=stiffer * before.stiffness,
        neutral=before.neutral + moved,
        damping=damped * before.damping,
    )


def _cuffs(before: Cuffs, disturbances: Disturbances, day: int) -> Cuffs:
    pull, twist = np.exp(_sd(disturbances, "cuff") * stream(day, "wearer", "day_to_day cuff").standard_normal(2))
    return replace(before, stiffness=before.stiffness * np.array([pull, pull, pull, twist, twist, twist]))


def _sd(disturbances: Disturbances, column: str) -> float:
    return _number(disturbances, "day_to_day", column)


def _number(disturbances: Disturbances, row: str, column: str) -> float:
    value = disturbances.value(row, column)
    if isinstance(value, tuple):
        raise TypeError(f"{row}.{column} is a range {value}; it is one number.")
    return value
