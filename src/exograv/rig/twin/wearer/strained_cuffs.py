"""Cuffs and soft tissue of a foreign world: straps that stiffen and slip, and flesh that wobbles on the bones."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from exograv.rig.twin.disturbances.streams import stream

STRAIN = 0.015
"""Strain at which the stiffness has grown by the drawn factor [m]."""

STRAIN_MAX = 0.03
"""Strain above which the stiffness does not grow any further [m]."""

SLIP_MAX = 0.015
"""Largest way by which a cuff slips [m]; then the limb's shape holds it."""

STIFFNESS_SD = 0.25
"""SD of the logarithm of a factor on the stiffness of a person's cuffs. Assumed [-]."""


@dataclass(frozen=True)
class StrainedCuffs:
    """Law of the cuffs of one person: F = K (exp(b x) − 1) / b on both sides, with Coulomb slip along the limb.

    Source: Schiebl (2025), Sensors 25:4605, whose best law has this form.
    """

    growth: float
    """Stiffness at `STRAIN` over that without strain [-]."""

    slip_force: float
    """Force along the limb above which a cuff slips [N]."""

    stiffness_factor: float
    """Ratio of this person's cuff stiffness to that of the level [-]."""

    @property
    def steepness(self) -> float:
        """Coefficient b of the law [1/m]."""
        return float(np.log(self.growth) / STRAIN)

    def stretched(self, strain: ca.SX) -> ca.SX:
        """Return the force over the stiffness without strain [m], for strains (n,) [m]."""
        size = ca.fabs(strain)
        within, beyond = ca.fmin(size, STRAIN_MAX), ca.fmax(size - STRAIN_MAX, 0.0)
        b = self.steepness
        return ca.sign(strain) * ((ca.exp(b * within) - 1.0) / b + np.exp(b * STRAIN_MAX) * beyond)

    def slip_strain(self, stiffness: float) -> float:
        """Return the strain along the limb at which a cuff of this stiffness [N/m] slips [m]."""
        if stiffness == 0.0:
            return np.inf
        b, wanted = self.steepness, self.slip_force / stiffness
        most = (np.exp(b * STRAIN_MAX) - 1.0) / b
        if wanted <= most:
            return float(np.log1p(b * wanted) / b)
        return STRAIN_MAX + float((wanted - most) / np.exp(b * STRAIN_MAX))

    def slipped(self, way: ca.SX, along: ca.SX, stiffness: float) -> ca.SX:
        """Return the way by which a cuff has slipped [m] after the limb has moved to `along` its rest place [m]."""
        strain = self.slip_strain(stiffness)
        if np.isinf(strain):
            return way
        moved = ca.fmin(ca.fmax(way, along - strain), along + strain)
        return ca.fmin(ca.fmax(moved, -SLIP_MAX), SLIP_MAX)


@dataclass(frozen=True)
class SoftTissue:
    """Part of a bone's mass that hangs on it by a spring and a damper, the same in all directions."""

    share: float
    """Share of the bone's mass [-]."""

    frequency: float
    """Natural frequency on a bone that is held [Hz]."""

    damping_ratio: float
    """Damping over critical damping. Assumed [-]."""

    @property
    def natural(self) -> float:
        """Natural angular frequency [rad/s]."""
        return 2.0 * np.pi * self.frequency


def draw_strained_cuffs(seed: int) -> StrainedCuffs:
    """Draw the cuffs of one person. The draw does not depend on the level."""
    generator = stream(seed, "wearer", "world cuffs")
    return StrainedCuffs(
        growth=float(generator.uniform(2.0, 4.0)),
        slip_force=float(generator.uniform(20.0, 60.0)),
        stiffness_factor=float(np.exp(STIFFNESS_SD * generator.standard_normal())),
    )


def draw_soft_tissue(seed: int, owner: str) -> dict[str, SoftTissue]:
    """Draw the soft tissue of upper arm and forearm of one arm, by segment. The draw does not depend on the level."""
    generator = stream(seed, owner, "world cuffs soft tissue")
    return {
        segment: SoftTissue(
            share=float(generator.uniform(0.2, 0.4)),
            frequency=float(generator.uniform(4.0, 8.0)),
            damping_ratio=float(generator.uniform(0.2, 0.4)),
        )
        for segment in ("upper_arm", "forearm")
    }
