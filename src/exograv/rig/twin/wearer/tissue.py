"""Tissue of a foreign world: elastic joints by other laws than the estimator's, coupled, with a rest that creeps.

Each law is a shape: torque over the stiffness of the level [rad], zero at rest and 1 at a distance of 1 rad.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.rig.twin.disturbances.streams import stream

from .relaxation import RelaxationMode

CREEP_SPAN = 120.0
"""Time after which the rest posture has moved by its drawn angle [s]."""

CREEP_TIME = 60.0
"""Time constant with which the creep slows down. Assumed [s]."""

TOGETHER = ("flexion", "abduction", "rotation")
"""Freedoms of the shoulder, which are coupled to each other."""


@dataclass(frozen=True)
class SinhLaw:
    """Hyperbolic sine: torque that stiffens alike on both sides."""

    steepness: float
    """Inverse of the angle over which the torque grows [1/rad]."""

    def shape(self, angle: ca.SX) -> ca.SX:
        """Torque over stiffness at an angle from rest [rad]."""
        return ca.sinh(self.steepness * angle) / np.sinh(self.steepness)


@dataclass(frozen=True)
class TwoSidedLaw:
    """Exponential on each side of the rest, each with its own steepness: exp(a + b θ) − exp(c − d θ) + e.

    Source: Riener & Edrich (1999), J Biomech 32:539, abstract; Yoon & Mansour (1982) for the hip, form unverified.
    """

    above: float
    """Steepness b towards larger angles [1/rad]."""

    below: float
    """Steepness d towards smaller angles [1/rad]."""

    def shape(self, angle: ca.SX) -> ca.SX:
        """Torque over stiffness at an angle from rest [rad]."""
        upper, lower = self.sizes
        return upper * (ca.exp(self.above * angle) - 1.0) - lower * (ca.exp(-self.below * angle) - 1.0)

    @property
    def sizes(self) -> tuple[float, float]:
        """Sizes exp(a) and exp(c) [rad], for which the shape is 1 at 1 rad and −1 at −1 rad; both are positive."""
        b, d = self.above, self.below
        rows = [[np.exp(b) - 1.0, 1.0 - np.exp(-d)], [1.0 - np.exp(-b), np.exp(d) - 1.0]]
        upper, lower = np.linalg.solve(rows, np.ones(2)).tolist()
        return upper, lower


@dataclass(frozen=True)
class CubicLaw:
    """Cubic law, which is soft about the rest."""

    def shape(self, angle: ca.SX) -> ca.SX:
        """Torque over stiffness at an angle from rest [rad]."""
        return angle**3


@dataclass(frozen=True)
class DeadZoneLaw:
    """No torque within a zone about the rest, and a linear torque outside."""

    half_width: float
    """Distance from the rest to the end of the zone [rad]."""

    def shape(self, angle: ca.SX) -> ca.SX:
        """Torque over stiffness at an angle from rest [rad]."""
        outside = ca.fmax(angle - self.half_width, 0.0) - ca.fmax(-angle - self.half_width, 0.0)
        return outside / (1.0 - self.half_width)


ElasticLaw = SinhLaw | TwoSidedLaw | CubicLaw | DeadZoneLaw


@dataclass(frozen=True)
class Tissue:
    """Passive elasticity of the freedoms of one arm, or of both arms, in place of linear springs."""

    laws: tuple[ElasticLaw, ...]
    """Law of each freedom."""

    coupling: Float[np.ndarray, "freedom freedom"]
    """Torque at a freedom per angle of another one from its rest; symmetric, so that it stores energy [N·m/rad]."""

    creep: Float[np.ndarray, " freedom"]
    """Angle by which the rest posture has moved after `CREEP_SPAN` [rad]."""

    hysteresis_decay: float
    """Time constant of the hysteresis [s]."""

    @property
    def relaxation(self) -> tuple[RelaxationMode, ...]:
        """Modes by which the fast part of the elasticity relaxes, here one."""
        return (RelaxationMode(1.0, self.hysteresis_decay),)

    @property
    def creep_states(self) -> int:
        """Number of states of the creep: the angle of each freedom."""
        return len(self.laws)

    def torque(self, stiffness: Float[np.ndarray, " freedom"], angle: ca.SX) -> ca.SX:
        """Elastic torque (freedom,) towards the rest, at angles (freedom,) from it [rad]."""
        shapes = [law.shape(part) for law, part in zip(self.laws, ca.vertsplit(angle), strict=True)]
        return ca.DM(stiffness) * ca.vertcat(*shapes) + ca.DM(self.coupling) @ angle

    def crept(self, moved: ca.SX, dt: float) -> ca.SX:
        """Angle (freedom,) by which the rest posture has moved one step `dt` [s] later.

        The creep follows the clock, not the load: it stands for muscle tone, which the wearer does not feel change.
        Its work is that of a muscle, so that the elasticity is passive only between two changes of the rest.
        """
        end = self.creep / (1.0 - np.exp(-CREEP_SPAN / CREEP_TIME))
        return moved + (ca.DM(end) - moved) * (1.0 - np.exp(-dt / CREEP_TIME))

    def rest_moved(self, moved: ca.SX) -> ca.SX:
        """Angle (freedom,) by which the rest posture has moved [rad]: the states themselves."""
        return moved


def draw_tissue(seed: int, owner: str, freedoms: Sequence[str], stiffness: Float[np.ndarray, " freedom"]) -> Tissue:
    """Draw the tissue of one arm. Its draws do not depend on the level; the level gives the stiffness [N·m/rad]."""
    generator = stream(seed, owner, "world tissue laws")
    laws = tuple(_draw_law(generator) for _ in freedoms)
    shares = stream(seed, owner, "world tissue coupling")
    coupling = np.zeros((len(freedoms), len(freedoms)))
    flexion, elbow = freedoms.index("flexion"), freedoms.index("elbow")
    _couple(coupling, flexion, elbow, shares.uniform(0.0, 0.5) * stiffness[elbow])
    for first, second in ((0, 1), (0, 2), (1, 2)):
        i, j = (freedoms.index(TOGETHER[k]) for k in (first, second))
        _couple(coupling, i, j, shares.uniform(0.0, 0.3) * min(stiffness[i], stiffness[j]))
    moving = stream(seed, owner, "world tissue creep")
    creep = np.deg2rad(moving.uniform(5.0, 15.0, len(freedoms))) * moving.choice([-1.0, 1.0], len(freedoms))
    # One time for both arms of a person.
    decay = float(stream(seed, "wearer", "world tissue hysteresis").uniform(0.5, 8.0))
    return Tissue(laws, coupling, creep, decay)


def both(tissues: Sequence[Tissue]) -> Tissue:
    """Tissue of all arms, in their order. Arms are not coupled to each other."""
    sizes = [len(tissue.laws) for tissue in tissues]
    coupling = np.zeros((sum(sizes), sum(sizes)))
    start = 0
    for tissue, size in zip(tissues, sizes, strict=True):
        coupling[start : start + size, start : start + size] = tissue.coupling
        start += size
    return Tissue(
        tuple(law for tissue in tissues for law in tissue.laws),
        coupling,
        np.concatenate([tissue.creep for tissue in tissues]),
        tissues[0].hysteresis_decay,
    )


def _draw_law(generator: np.random.Generator) -> ElasticLaw:
    kind = int(generator.integers(4))
    first, second = generator.uniform(0.5, 2.0, 2).tolist()
    half_width = float(np.deg2rad(generator.uniform(5.0, 20.0)))
    return (SinhLaw(first), TwoSidedLaw(first, second), CubicLaw(), DeadZoneLaw(half_width))[kind]


def _couple(coupling: Float[np.ndarray, "freedom freedom"], i: int, j: int, stiffness: float) -> None:
    coupling[i, j] = coupling[j, i] = stiffness
