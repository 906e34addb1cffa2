"""Slow changes of a worn machine, and the torque by which each would change the same motion."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.hidden_cuffs import ALONG
from exograv.identification.core.interface import Parameters, Sample
from exograv.model.rig_settings import Place

from .slow_change import Cause, Kind

Effect = Float[np.ndarray, "sample joint column"]


USUAL_SIZE: Mapping[Kind, float] = MappingProxyType(
    {
        Kind.CUFF: 0.015,
        Kind.SHOULDER: 0.01,
        Kind.WARM_UP: 0.10,
        Kind.FRICTION: 0.15,
        Kind.CONSTANT: 0.03,
        Kind.TONE: 0.6,
    }
)
"""Standard deviation of a change that happens, by kind. Cuffs slip by up to 15 mm and friction falls by 10-20 % within
half an hour (docs/explanation/arm.md). The others are assumed: a seated person moves by a centimetre, magnets lose 3 %
of their strength, and muscles that do not relax give twice the assumed slow torque."""

HAPPENS: Mapping[Kind, float] = MappingProxyType({**dict.fromkeys(Kind, 0.02), Kind.WARM_UP: 0.3})
"""Prior probability of a change since the motion before [-]. Assumed; all drives of a machine in use warm up."""


@dataclass(frozen=True)
class Effects:
    """Residual torque of a motion, and the effect of each possible change on it."""

    residual: Float[np.ndarray, "sample joint"]
    """Measured torque minus torque of the model [N·m]."""

    by_size: Effect
    """Torque per size of each column [N·m per unit of `Kind`]."""

    direction_sd: Float[np.ndarray, "sample joint"]
    """Torque that an uncertain direction of motion may add [N·m]."""


def possible_causes(model: ArmModel) -> tuple[Cause, ...]:
    """Return all changes that are considered, with their columns."""
    assembly, found, next_column = model.assembly, list[Cause](), 0
    joints, arm = assembly.description.joints, assembly.arm
    for kind, places, width in (
        (Kind.CUFF, [cuff.name for cuff in assembly.cuffs if cuff.along_N_per_mm > 0.0], 1),
        (Kind.SHOULDER, [limb.prefix + "shoulder" for limb in arm.limbs], 3),
        (Kind.WARM_UP, ["drives"], 1),
        (Kind.FRICTION, joints, 1),
        (Kind.CONSTANT, joints, 1),
        (Kind.TONE, arm.freedoms, 1),
    ):
        for place in places:
            found.append(Cause(kind, place, tuple(range(next_column, next_column + width))))
            next_column += width
    return tuple(found)


def effects(model: ArmModel, x: Parameters, samples: list[Sample]) -> Effects:
    """Compare a motion with the model at the parameters `x`."""
    assembly, layout = model.assembly, ParameterLayout.of(model.assembly)
    held = [c for c, cuff in enumerate(assembly.cuffs) if cuff.along_N_per_mm > 0.0]
    offsets = [layout.fit.start + i for arm in range(layout.arms) for i in _offset_of(layout, arm)]
    coulomb, viscous = x[layout.coulomb], x[layout.viscous]
    residual, rows, direction = [], [], []
    model.restart()
    for sample in samples:
        expected, D = model.linearise(sample, x)
        along = model.cuff_loads().by_displacement[:, held, ALONG]
        friction = D[:, layout.coulomb] * coulomb + D[:, layout.viscous] * viscous
        # A spring's offset pulls the arm towards larger angles, so it acts like a muscle of the wearer.
        of_all = friction.sum(axis=1, keepdims=True)
        columns = [along, D[:, offsets], of_all, friction, np.diag(expected), D[:, layout.spring_offset]]
        rows.append(np.hstack(columns))
        residual.append(sample.tau - expected)
        direction.append(model.direction_uncertainty(sample.v))
    model.restart()
    return Effects(np.array(residual), np.array(rows), np.array(direction))


def place_of(freedom: str) -> Place:
    """Place of a freedom of the arm, by its name."""
    if freedom.endswith(("flexion", "abduction", "rotation")) and "wrist" not in freedom:
        return "shoulder"
    return "elbow" if freedom.endswith("elbow") else "wrist"


def _offset_of(layout: ParameterLayout, arm: int) -> range:
    """Places of an arm's shoulder offset within the slice `fit`."""
    each = (layout.fit.stop - layout.fit.start) // layout.arms
    return range(arm * each, arm * each + 3)
