"""An arm under water: buoyancy of each bone, and drag by MuJoCo's inertia boxes; machines stay dry.

    weight felt = (1 − ρ_water / ρ_bone) m g,   drag on a face = ½ ρ_water A v²,   and a little viscosity

Each bone is displaced at its centre of mass. Added mass is not modelled: water that an arm has to accelerate would make
it feel up to twice as heavy to move sideways, and no heavier to hold.

Source: equivalent boxes and both forces, documentation of MuJoCo, computation/fluid.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import mujoco

from exograv.rig.twin.wearer.arm_bodies import body_name
from exograv.rig.twin.wearer.skeleton import Skeleton

BODY_DENSITY: Mapping[str, float] = MappingProxyType({"upper_arm": 1070.0, "forearm": 1130.0, "hand": 1160.0})
"""Of segments [kg/m³]. Source: Dempster (1955) as told by users of Yeadon (1990); neither was read, so unverified."""

DRY_SIZE = 1e-6
"""Of the ball that keeps a body out of the water [m]."""


@dataclass(frozen=True)
class Water:
    """Of a warm pool, 30 °C; both from tables of water, unverified."""

    density: float = 995.7
    """[kg/m³]"""

    viscosity: float = 0.80e-3
    """[Pa·s]"""

    body_density: Mapping[str, float] = field(default_factory=lambda: dict(BODY_DENSITY))
    """Of the arm, by segment [kg/m³]."""


def flood(spec: mujoco.MjSpec, water: Water, skeletons: Sequence[Skeleton]) -> None:
    """Put a world that has the wearer's arms under water, and keep all else dry."""
    spec.option.density, spec.option.viscosity = water.density, water.viscosity
    wet = {body_name(skeleton, bone.name): bone.segment for skeleton in skeletons for bone in skeleton.bones}
    for body in spec.bodies:
        if body.name in wet:
            body.gravcomp = water.density / water.body_density[wet[body.name]]
        elif body is not spec.worldbody:
            # A body with a shape of its own has no inertia box in the water, and this shape has no coefficient.
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[DRY_SIZE, 0.0, 0.0],
                contype=0,
                conaffinity=0,
                mass=0.0,
                fluid_ellipsoid=1,
                fluid_coefs=[0.0] * 5,
            )
