"""Tissue of the unseen world: passive muscles with moment arms, a rest that creeps by powers of time, slow relaxation.

The elastic torque is the slope of an energy: each muscle's tension times its moment arms.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from jaxtyping import Float
from numpy.polynomial import Polynomial

from exograv.rig.twin.disturbances.streams import stream

from .relaxation import RelaxationMode, RelaxationSpectrum, draw_relaxation
from .rest_creep import CreepCourse, draw_course
from .tissue import TOGETHER

TOE = 1.5
"""Elongation beyond slack up to which the tension of a muscle is exponential; further on it is linear [rad].

Source: linear extension of the passive curve, Millard et al. (2013), J Biomech Eng 135:021005 (form only, unverified).
"""

STEEPNESS = (0.7, 2.2)
"""Range of the steepness of a muscle's tension [1/rad].

Computed: tension ~ exp(k ε / ε0) with k of 3 to 5 and ε0 of 0.5 to 0.7 (Thelen 2003, J Biomech Eng 125:70, unverified)
and moment arms of 0.15 to 0.25 of a fibre's length.
"""

BICEPS_ARM_CM = (1.963, -1.44, 3.031, 0.887, -1.418, 0.285)
"""Moment arm of the biceps about the elbow, by powers of the elbow's angle [cm, rad].

Source: biomed.bas.bg, MuscleArms, after Pigeon, Yahia & Feldman (1996), J Biomech 29:1365.
"""

TRICEPS_ARM_CM = (-2.365, -1.015, 1.92, -1.035, 0.257, -0.0262)
"""Moment arm of the triceps about the elbow, by powers of the elbow's angle [cm, rad]. Source: as for the biceps."""

SHOULDER_OVER_ELBOW = (0.21, 1.71)
"""Range of the moment arm at the shoulder over that at the elbow, for muscles that cross both [-].

Source: biceps, Dhaliwal & Milner (2003), doi 10.1109/IEMBS.2003.1279768, abstract. Assumed for the triceps.
"""


@dataclass(frozen=True)
class MomentArm:
    """Moment arm of a muscle at one freedom, as a polynomial of the freedom's angle from its rest."""

    freedom: int
    """Index of the freedom."""

    coefficients: tuple[float, ...]
    """Lengthening per angle [-], by rising powers of the angle [rad]; positive if the muscle lengthens."""

    def arm(self, angle: ca.SX) -> ca.SX:
        """Lengthening of the muscle per angle, at an angle from rest [rad]."""
        return ca.polyval(ca.DM(self.coefficients[::-1]), angle)

    def lengthening(self, angle: ca.SX) -> ca.SX:
        """Lengthening of the muscle from the rest to an angle [rad]."""
        integral = [c / (power + 1) for power, c in enumerate(self.coefficients)]
        return ca.polyval(ca.DM([*integral[::-1], 0.0]), angle)


@dataclass(frozen=True)
class PassiveMuscle:
    """Muscle at rest, which pulls where it is longer than slack: size · (exp(steepness · elongation) − 1).

    Source: form of the passive element, Thelen (2003), J Biomech Eng 125:70 (unverified).
    """

    arms: tuple[MomentArm, ...]
    steepness: float
    """Inverse of the elongation over which the tension grows [1/rad]."""

    taut: float
    """Elongation beyond slack in the rest posture [rad]."""

    size: float
    """Scale of the tension [N·m], or over the stiffness of the level [rad]."""

    def tension(self, angle: ca.SX) -> ca.SX:
        """Tension divided by `size` [-], at angles (freedom,) from the rest posture [rad]."""
        reach = sum((one.lengthening(angle[one.freedom]) for one in self.arms), ca.SX(self.taut))
        within, beyond = ca.fmin(ca.fmax(reach, 0.0), TOE), ca.fmax(reach - TOE, 0.0)
        at_toe = np.exp(self.steepness * TOE)
        return ca.exp(self.steepness * within) - 1.0 + self.steepness * at_toe * beyond

    def torque(self, angle: ca.SX) -> ca.SX:
        """Torque (freedom,) towards the rest, at angles (freedom,) from it [rad]."""
        tau, pull = ca.SX.zeros(angle.numel()), self.size * self.tension(angle)
        for one in self.arms:
            tau[one.freedom] += pull * one.arm(angle[one.freedom])
        return tau

    def moved(self, freedoms: int) -> "PassiveMuscle":
        """Return the muscle with all its freedoms counted `freedoms` later."""
        return replace(self, arms=tuple(replace(one, freedom=one.freedom + freedoms) for one in self.arms))


@dataclass(frozen=True)
class MuscleTissue:
    """Passive elasticity of the freedoms of one arm, or of both arms, by muscles in place of springs."""

    pairs: tuple[tuple[PassiveMuscle, PassiveMuscle], ...]
    """Two muscles that cross each freedom alone, one on each side; their sizes are over the level's stiffness."""

    shared: tuple[PassiveMuscle, ...]
    """Muscles that cross several freedoms, slack up to the rest posture."""

    creep: Float[np.ndarray, " freedom"]
    """Angle by which the rest posture has moved after `tissue.CREEP_SPAN` [rad]."""

    courses: tuple[CreepCourse, ...]
    """Course of the creep of each freedom."""

    spectrum: RelaxationSpectrum

    @property
    def relaxation(self) -> tuple[RelaxationMode, ...]:
        """Modes by which the fast part of the elasticity relaxes."""
        return self.spectrum.modes

    @property
    def creep_states(self) -> int:
        """Number of states of the creep: the time since the start."""
        return 1

    def torque(self, stiffness: Float[np.ndarray, " freedom"], angle: ca.SX) -> ca.SX:
        """Elastic torque (freedom,) towards the rest, at angles (freedom,) from it [rad]."""
        alone = ca.SX.zeros(angle.numel())
        for muscle in (one for pair in self.pairs for one in pair):
            alone += muscle.torque(angle)
        shared = sum((muscle.torque(angle) for muscle in self.shared), ca.SX.zeros(angle.numel()))
        return ca.DM(stiffness) * alone + shared

    def crept(self, time: ca.SX, dt: float) -> ca.SX:
        """Time since the start [s], one step `dt` [s] later. As in `tissue`, the creep follows the clock."""
        return time + dt

    def rest_moved(self, time: ca.SX) -> ca.SX:
        """Angle (freedom,) by which the rest posture has moved at a time since the start [rad]."""
        return ca.DM(self.creep) * ca.vertcat(*(course.share(time) for course in self.courses))


def draw_muscle_tissue(
    seed: int,
    owner: str,
    freedoms: Sequence[str],
    stiffness: Float[np.ndarray, " freedom"],
    neutral: Float[np.ndarray, " freedom"],
) -> MuscleTissue:
    """Draw the tissue of one arm. Its draws do not depend on the level.

    The level gives the stiffness [N·m/rad] and the neutral angles [rad].
    """
    generator = stream(seed, owner, "world unseen pairs")
    pairs = tuple(_draw_pair(generator, freedom) for freedom in range(len(freedoms)))
    sharing = stream(seed, owner, "world unseen shared")
    places = [freedoms.index(freedom) for freedom in TOGETHER]
    shared = (
        *_draw_biarticular(sharing, freedoms.index("flexion"), freedoms.index("elbow"), stiffness, neutral),
        *(_draw_shoulder_muscle(sharing, places, stiffness) for _ in range(2)),
    )
    moving = stream(seed, owner, "world unseen creep")
    creep = np.deg2rad(moving.uniform(5.0, 15.0, len(freedoms))) * moving.choice([-1.0, 1.0], len(freedoms))
    courses = tuple(draw_course(moving) for _ in freedoms)
    # One spectrum for both arms of a person.
    return MuscleTissue(pairs, shared, creep, courses, draw_relaxation(seed))


def both_muscled(tissues: Sequence[MuscleTissue]) -> MuscleTissue:
    """Tissue of all arms, in their order. Arms are not coupled to each other."""
    starts = np.cumsum([0, *(len(tissue.pairs) for tissue in tissues)]).tolist()
    placed = list(zip(tissues, starts, strict=False))
    return MuscleTissue(
        tuple((one.moved(start), other.moved(start)) for tissue, start in placed for one, other in tissue.pairs),
        tuple(muscle.moved(start) for tissue, start in placed for muscle in tissue.shared),
        np.concatenate([tissue.creep for tissue in tissues]),
        tuple(course for tissue in tissues for course in tissue.courses),
        tissues[0].spectrum,
    )


def _draw_pair(generator: np.random.Generator, freedom: int) -> tuple[PassiveMuscle, PassiveMuscle]:
    """Return two muscles that hold each other at rest, with the level's mean stiffness from −1 to 1 rad."""
    sides = []
    for sign in (1.0, -1.0):
        slope, curve = generator.uniform(-0.15, 0.15), generator.uniform(-0.06, 0.06)
        steepness, taut = generator.uniform(*STEEPNESS), generator.uniform(0.1, 0.6)
        # Both moment arms are 1 at rest; the level's stiffness has the unit.
        arm = MomentArm(freedom, (sign, sign * slope, sign * curve))
        sides.append(PassiveMuscle((arm,), float(steepness), float(taut), 1.0))
    at = np.array([[_torque(side, freedom, angle) for side in sides] for angle in (0.0, 1.0, -1.0)])
    upper, lower = np.linalg.solve([at[0], 0.5 * (at[1] - at[2])], [0.0, 1.0]).tolist()
    return replace(sides[0], size=upper), replace(sides[1], size=lower)


def _draw_biarticular(
    generator: np.random.Generator,
    flexion: int,
    elbow: int,
    stiffness: Float[np.ndarray, " freedom"],
    neutral: Float[np.ndarray, " freedom"],
) -> tuple[PassiveMuscle, PassiveMuscle]:
    """Return the biceps, which extension of both joints lengthens, and the long head of the triceps."""
    muscles = []
    for published, longer in ((BICEPS_ARM_CM, -1.0), (TRICEPS_ARM_CM, 1.0)):
        share, ratio = generator.uniform(0.0, 0.5), generator.uniform(*SHOULDER_OVER_ELBOW)
        steepness = generator.uniform(*STEEPNESS)
        from_rest = Polynomial(published)(Polynomial([neutral[elbow], 1.0]))
        shape = np.asarray(from_rest.coef, dtype=float)
        at_elbow = longer * shape / shape[0]
        arms = MomentArm(flexion, (longer * float(ratio),)), MomentArm(elbow, tuple(at_elbow.tolist()))
        muscles.append(_sized(PassiveMuscle(arms, float(steepness), 0.0, 1.0), elbow, longer, share * stiffness[elbow]))
    biceps, triceps = muscles
    return biceps, triceps


def _draw_shoulder_muscle(
    generator: np.random.Generator, places: Sequence[int], stiffness: Float[np.ndarray, " freedom"]
) -> PassiveMuscle:
    """Return a muscle that crosses all freedoms of the shoulder, with moment arms that change with each angle."""
    direction = generator.standard_normal(len(places))
    direction /= np.linalg.norm(direction)
    bends = generator.uniform(-0.15, 0.15, len(places))
    arms = tuple(
        MomentArm(place, (float(size), float(size * bend)))
        for place, size, bend in zip(places, direction, bends, strict=True)
    )
    share, steepness = generator.uniform(0.0, 0.3), float(generator.uniform(*STEEPNESS))
    softest = float(min(stiffness[place] for place in places))
    return PassiveMuscle(arms, steepness, 0.0, float(share * softest / np.expm1(steepness)))


def _sized(muscle: PassiveMuscle, freedom: int, angle: float, torque: float) -> PassiveMuscle:
    """Return the muscle with the size that gives a torque [N·m] at an angle of one freedom [rad]."""
    return replace(muscle, size=float(torque / abs(_torque(muscle, freedom, angle))))


def _torque(muscle: PassiveMuscle, freedom: int, angle: float) -> float:
    """Torque of a muscle at one freedom, when this freedom alone is at an angle from rest [rad]."""
    count = 1 + max(one.freedom for one in muscle.arms)
    angles = ca.SX.zeros(count)
    angles[freedom] = angle
    return float(ca.DM(ca.evalf(muscle.torque(angles)))[freedom])
