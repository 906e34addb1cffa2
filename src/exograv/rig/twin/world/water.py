"""Arm under water: buoyancy of each bone, and drag on MuJoCo's inertia boxes; machines stay dry.

    weight felt = (1 − ρ_water / ρ_bone) m g,   drag on a face = ½ ρ_water A v²,   and a small viscous drag

Buoyancy acts at the centre of mass of each bone. Added mass is not modelled: with the water that an arm accelerates,
the arm would feel up to twice as heavy to move sideways, and no heavier to hold.

Source: equivalent boxes and both forces, documentation of MuJoCo, computation/fluid.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import mujoco

from exograv.rig.twin.wearer.arm_bodies import SOFT, body_name
from exograv.rig.twin.wearer.skeleton import Skeleton

BODY_DENSITY: Mapping[str, float] = MappingProxyType({"upper_arm": 1070.0, "forearm": 1130.0, "hand": 1160.0})
"""Densities of segments [kg/m³].

Source: Dempster (1955) as quoted by users of Yeadon (1990); neither was read, so unverified.
"""

DRY_SIZE = 1e-6
"""Radius of the sphere that keeps a body out of the water [m]."""


@dataclass(frozen=True)
class Water:
    """Water of a warm pool, 30 °C; density and viscosity from tables of water, unverified."""

    density: float = 995.7
    """Density of the water [kg/m³]."""

    viscosity: float = 0.80e-3
    """Viscosity of the water [Pa·s]."""

    body_density: Mapping[str, float] = field(default_factory=lambda: dict(BODY_DENSITY))
    """Densities of the arm, by segment [kg/m³]."""


def flood(spec: mujoco.MjSpec, water: Water, skeletons: Sequence[Skeleton]) -> None:
    """Put a world that has the wearer's arms under water, and keep all other bodies dry."""
    spec.option.density, spec.option.viscosity = water.density, water.viscosity
    wet = {body_name(skeleton, bone.name): bone.segment for skeleton in skeletons for bone in skeleton.bones}
    soft = {f"{name}{SOFT}": segment for name, segment in wet.items()}
    for body in spec.bodies:
        if body.name in wet or body.name in soft:
            body.gravcomp = water.density / water.body_density[(wet | soft)[body.name]]
        # Soft tissue floats with its bone, whose box has the drag.
        if body.name in wet:
            continue
        if body is not spec.worldbody:
            # MuJoCo gives a body with an ellipsoid shape no inertia box in the water. The coefficients of this shape
            # are zero, so that it has no drag.
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[DRY_SIZE, 0.0, 0.0],
                contype=0,
                conaffinity=0,
                mass=0.0,
                fluid_ellipsoid=1,
                fluid_coefs=[0.0] * 5,
            )
