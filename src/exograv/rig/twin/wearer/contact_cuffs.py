"""Cuffs of the unseen world: preloaded contacts with lagging flesh, which creep along the limb under any load.

A strap presses both sides of the limb by a depth d. Each side is a contact of exponent n (1.5: Hertz; 2: a cone), and a
side that lifts off no longer acts:

    F = c ((d + x)₊ⁿ − (d − x)₊ⁿ)

Flesh beneath the cuff adds a Maxwell element (Zener's standard linear solid). Along the limb the cuff slips at a speed
that is a power of the force (Norton).

Source: exponents of indenters, Hertz (1882) and Sneddon (1965), Int J Eng Sci 3:47; standard linear solid and power-law
flow: textbooks. All ranges are assumed.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.streams import stream
from exograv.rig.twin.machine.machine_bodies import TIMESTEP

from .strained_cuffs import SLIP_MAX, STIFFNESS_SD, STRAIN_MAX

SAME = 0.01
"""Strain at which a contact has the force of the level's linear cuff [m]."""

SLIP_SPEED = 5e-4
"""Speed at which a cuff slips under its slip force [m/s]. Assumed."""


@dataclass(frozen=True)
class Contact:
    """Preloaded contact of two sides, in one direction."""

    exponent: float
    """Exponent n of each side, above 1 [-]."""

    preload: float
    """Depth d of both sides without a force from outside [m]."""

    def stretched(self, strain: ca.SX) -> ca.SX:
        """Return the force over the stiffness of the level [m], for a strain [m]. It is linear beyond `STRAIN_MAX`."""
        within = ca.fmin(ca.fmax(strain, -STRAIN_MAX), STRAIN_MAX)
        shape = self._side(self.preload + within) - self._side(self.preload - within)
        return SAME / self._shape(SAME) * (shape + self._slope(STRAIN_MAX) * (strain - within))

    def tangent(self, strain: ca.SX) -> ca.SX:
        """Return the stiffness at a strain [m] over that of the level [-]."""
        within = ca.fmin(ca.fabs(strain), STRAIN_MAX)
        rise = self.exponent * ca.fmax(self.preload + within, 0.0) ** (self.exponent - 1.0)
        fall = self.exponent * ca.fmax(self.preload - within, 0.0) ** (self.exponent - 1.0)
        return SAME / self._shape(SAME) * (rise + fall)

    def _side(self, depth: ca.SX) -> ca.SX:
        return ca.fmax(depth, 0.0) ** self.exponent

    def _shape(self, strain: float) -> float:
        sides = (max(self.preload + sign * strain, 0.0) ** self.exponent for sign in (1.0, -1.0))
        return float(next(sides) - next(sides))

    def _slope(self, strain: float) -> float:
        sides = (max(self.preload + sign * strain, 0.0) ** (self.exponent - 1.0) for sign in (1.0, -1.0))
        return self.exponent * float(sum(sides))


@dataclass(frozen=True)
class ContactCuffs:
    """Law of the cuffs of one person."""

    across: Contact
    along: Contact
    stiffness_factor: Float[np.ndarray, " 6"]
    """Ratio of this person's cuff stiffness to that of the level, in the directions of `Cuffs.stiffness` [-]."""

    lag_share: float
    """Ratio of the lagging flesh's stiffness to that of the level [-]."""

    lag: float
    """Time constant of the lagging flesh [s]."""

    slip_force: float
    """Force along the limb under which a cuff slips at `SLIP_SPEED` [N]."""

    slip_exponent: float
    """Exponent of the slip's speed against the force [-]."""

    def stretched(self, strain: ca.SX) -> ca.SX:
        """Return the force over the stiffness of the level [m], for strains (3,) [m], z along the limb."""
        return ca.vertcat(
            self.across.stretched(strain[0]), self.across.stretched(strain[1]), self.along.stretched(strain[2])
        )

    def slipped(self, way: ca.SX, along: ca.SX, stiffness: float) -> ca.SX:
        """Return the way by which a cuff has slipped [m] one step later, with the limb at `along` its rest place [m].

        speed = SLIP_SPEED · |F / slip force|^exponent, towards the force. The step is implicit to first order: it never
        passes the rest place, however stiff the cuff.
        """
        if stiffness == 0.0:
            return way
        load = stiffness * self.along.stretched(along - way) / self.slip_force
        size = ca.fabs(load)
        speed = SLIP_SPEED * size**self.slip_exponent
        per_way = SLIP_SPEED * self.slip_exponent * size ** (self.slip_exponent - 1.0) * stiffness / self.slip_force
        relief = 1.0 + TIMESTEP * per_way * self.along.tangent(along - way)
        moved = way + ca.sign(load) * TIMESTEP * speed / relief
        return ca.fmin(ca.fmax(moved, -SLIP_MAX), SLIP_MAX)

    def lagged(self, strain: ca.SX, speed: ca.SX) -> ca.SX:
        """Return the strain (3,) of the lagging flesh [m] one step later; the cuff's strain has a speed (3,) [m/s]."""
        decay = np.exp(-TIMESTEP / self.lag)
        return decay * strain + self.lag * (1.0 - decay) * speed


def draw_contact_cuffs(seed: int) -> ContactCuffs:
    """Draw the cuffs of one person. The draw does not depend on the level."""
    generator = stream(seed, "wearer", "world unseen cuffs")
    across, along = (
        Contact(float(generator.uniform(low, high)), float(generator.uniform(0.002, 0.01)))
        for low, high in ((1.2, 2.0), (1.1, 1.7))
    )
    in_plane, along_limb, turning = np.exp(STIFFNESS_SD * generator.standard_normal(3)).tolist()
    return ContactCuffs(
        across=across,
        along=along,
        stiffness_factor=np.array([in_plane, in_plane, along_limb, turning, turning, turning]),
        lag_share=float(generator.uniform(0.1, 0.6)),
        lag=float(np.exp(generator.uniform(np.log(0.05), np.log(5.0)))),
        slip_force=float(generator.uniform(20.0, 60.0)),
        slip_exponent=float(generator.uniform(3.0, 8.0)),
    )
