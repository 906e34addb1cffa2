"""Order of all learned parameters of an arm in a machine in one vector `x`.

Identification writes the vector and control reads it; the two rooms do not import each other.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.model.arm import Arm
from exograv.model.assembly import Assembly
from exograv.model.loops import FIT, PATH_ENTRIES, fit_names

Parameters = Float[np.ndarray, " parameter"]
Joints = Float[np.ndarray, " joint"]

PHI_NAMES = ("mass", "mx", "my", "mz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz")
FIT_UNITS = (
    *("m", "m", "m", "m/rad", "m", "-", "-", "-", "-", "m/rad", "m/rad"),
    *("m" for _ in range(PATH_ENTRIES.start, PATH_ENTRIES.stop)),
)
PHI_UNITS = ("kg", "kg·m", "kg·m", "kg·m", *["kg·m²"] * 6)


@dataclass(frozen=True)
class ParameterLayout:
    """Slices of `x`, for the sizes of arms and machine."""

    segments: int
    freedoms: int
    arms: int
    joints: int
    """Number of joints of the machine."""

    @classmethod
    def of(cls, assembly: Assembly) -> "ParameterLayout":
        """Layout for these arms in this machine."""
        arm = assembly.arm
        return cls(len(arm.segments), len(arm.freedoms), len(arm.limbs), assembly.n)

    @property
    def phi(self) -> slice:
        """Slice of the inertial parameters of all segments, ten per segment."""
        return slice(0, 10 * self.segments)

    @property
    def bodies(self) -> tuple[slice, ...]:
        """Slices of the inertial parameters, one per segment."""
        return tuple(slice(10 * i, 10 * i + 10) for i in range(self.segments))

    @property
    def stiffness(self) -> slice:
        """Slice of the passive stiffness of the arm's joints [N·m/rad]."""
        return self._after(self.phi, self.freedoms)

    @property
    def spring_offset(self) -> slice:
        """Slice of stiffness times neutral angle [N·m]."""
        return self._after(self.stiffness, self.freedoms)

    @property
    def damping(self) -> slice:
        """Slice of the passive damping [N·m·s/rad]."""
        return self._after(self.spring_offset, self.freedoms)

    @property
    def fit(self) -> slice:
        """Slice of the fit of each arm in the machine, as in `model.loops.FIT`."""
        return self._after(self.damping, self.arms * len(FIT))

    @property
    def rotor(self) -> slice:
        """Slice of the rotor inertias at the machine's joints [kg·m²]."""
        return self._after(self.fit, self.joints)

    @property
    def coulomb(self) -> slice:
        """Slice of the Coulomb friction [N·m]."""
        return self._after(self.rotor, self.joints)

    @property
    def viscous(self) -> slice:
        """Slice of the viscous friction [N·m·s/rad]."""
        return self._after(self.coulomb, self.joints)

    @property
    def count(self) -> int:
        """Number of parameters: the length of `x`."""
        return self.viscous.stop

    @staticmethod
    def _after(block: slice, size: int) -> slice:
        return slice(block.stop, block.stop + size)


def names_and_units(assembly: Assembly) -> Iterator[tuple[str, str]]:
    """Yield name and unit of each entry of `x`."""
    arm, joints = assembly.arm, assembly.description.joints
    for segment in arm.segments:
        yield from ((f"{segment}.{name}", unit) for name, unit in zip(PHI_NAMES, PHI_UNITS, strict=True))
    for kind, unit in (("stiffness", "N·m/rad"), ("spring_offset", "N·m"), ("damping", "N·m·s/rad")):
        yield from ((f"{freedom}.{kind}", unit) for freedom in arm.freedoms)
    yield from zip(fit_names(assembly), FIT_UNITS * len(arm.limbs), strict=True)
    for kind, unit in (("rotor_inertia", "kg·m²"), ("coulomb", "N·m"), ("viscous", "N·m·s/rad")):
        yield from ((f"{joint}.{kind}", unit) for joint in joints)


def table_parameters(arm: Arm, rotor_inertia: Joints, coulomb_Nm: Joints, viscous_Nms: Joints) -> Parameters:
    """Parameters before any motion: the table's arm, aligned and without elasticity, in the calibrated machine."""
    unknown = np.zeros(3 * len(arm.freedoms) + len(arm.limbs) * len(FIT))
    return np.concatenate([arm.phi, unknown, rotor_inertia, coulomb_Nm, viscous_Nms])
