"""The order in which everything that is learned about an arm in a machine stands in one vector `x`.

Control and identification share it: what one learns, the other uses, without knowing each other.
"""

from collections.abc import Iterator

import numpy as np
from jaxtyping import Float

from exograv.model.arm import SEGMENTS, Arm
from exograv.model.assembly import FREEDOMS
from exograv.model.loops import FIT

Parameters = Float[np.ndarray, " parameter"]
Joints = Float[np.ndarray, " joint"]

PHI = slice(0, 20)
"""Inertial parameters: upper arm, forearm with hand."""
STIFFNESS = slice(20, 24)
"""Passive stiffness of the arm's joints [N·m/rad]."""
SPRING_OFFSET = slice(24, 28)
"""Stiffness times neutral angle [N·m]."""
DAMPING = slice(28, 32)
"""Passive damping [N·m·s/rad]."""
FIT_OF_ARM = slice(32, 32 + len(FIT))
"""How the arm sits in the machine, as `model.loops.FIT`."""

PHI_NAMES = ("mass", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
FIT_UNITS = ("m", "m", "m", "m/rad", "m", "-", "-")
PHI_UNITS = ("kg", "kg·m", "kg·m", "kg·m", *["kg·m²"] * 6)


def rotor(n: int) -> slice:
    """Rotor inertias at the joints of a machine with n joints [kg·m²]."""
    return slice(FIT_OF_ARM.stop, FIT_OF_ARM.stop + n)


def coulomb(n: int) -> slice:
    """Coulomb friction [N·m]."""
    return slice(FIT_OF_ARM.stop + n, FIT_OF_ARM.stop + 2 * n)


def viscous(n: int) -> slice:
    """Viscous friction [N·m·s/rad]."""
    return slice(FIT_OF_ARM.stop + 2 * n, FIT_OF_ARM.stop + 3 * n)


def count(n: int) -> int:
    """Length of `x`."""
    return FIT_OF_ARM.stop + 3 * n


def names_and_units(joints: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    """Name and unit of each entry of `x`."""
    for segment in SEGMENTS:
        yield from ((f"{segment}.{name}", unit) for name, unit in zip(PHI_NAMES, PHI_UNITS, strict=True))
    for kind, unit in (("stiffness", "N·m/rad"), ("spring_offset", "N·m"), ("damping", "N·m·s/rad")):
        yield from ((f"{freedom}.{kind}", unit) for freedom in FREEDOMS)
    yield from zip(FIT, FIT_UNITS, strict=True)
    for kind, unit in (("rotor_inertia", "kg·m²"), ("coulomb", "N·m"), ("viscous", "N·m·s/rad")):
        yield from ((f"{joint}.{kind}", unit) for joint in joints)


def table_parameters(arm: Arm, rotor_inertia: Joints, coulomb_Nm: Joints, viscous_Nms: Joints) -> Parameters:
    """What is known before anything moved: the table's arm without elasticity, aligned, in the calibrated machine."""
    return np.concatenate([arm.phi, np.zeros(12 + len(FIT)), rotor_inertia, coulomb_Nm, viscous_Nms])
