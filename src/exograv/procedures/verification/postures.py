"""Postures of a verification: postures of the task workspace that were not used for identification."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from exograv import motion
from exograv.errors import ModelError
from exograv.identification.core.arm_model import SINGULAR_SD, ArmModel
from exograv.identification.core.interface import Parameters
from exograv.loop.phases import TRAVEL_RAD_S
from exograv.model.description import RigDescription
from exograv.motion import Trajectory
from exograv.procedures.identification.check_motion import in_short_order
from exograv.sobol import sobol_points

POSTURES = 12
CANDIDATES = 64
UNSEEN_RAD = 0.15
"""Least distance of an unseen posture from the identification's motion, in the joint that is farthest off [rad]."""

REACH_RAD = 0.2
"""Half length of a pass about its posture, for every joint [rad]."""

SPEED_RAD_S = 0.25
"""Speed of a pass [rad/s]: slow, so that inertia and damping are negligible, and fast enough that every joint slides.
"""


ROUNDS = 2
"""Rounds through all postures, in the same order. After a minute the wearer's slow torque is another one, so a repeated
torque at a posture is not the wearer's.
"""

NONE = -1
"""Index of ticks outside all passes."""

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "posture joint"]


def unseen_postures(model: ArmModel, x: Parameters, seen: Float[np.ndarray, "tick joint"], seed: int) -> Postures:
    """Return `POSTURES` of a seed [rad], spread over the workspace, with room for a pass about each, in a short order.

    Args:
        model: Model of the arm in its machine. A posture near a singularity of the arm is left out.
        x: Parameters of the arm.
        seen: Postures of the identification's motion [rad].
        seed: Seed of the postures; the same seed gives the same postures.

    Raises:
        ModelError: The task workspace has no room for them.
    """
    description = model.assembly.description
    found = [q for q in _spread(description, seed) if _is_unseen(q, seen) and _is_clear(model, q, x)]
    if len(found) < POSTURES:
        raise ModelError(
            f"{description.name} has {len(found)} postures of {CANDIDATES} in its task workspace that the "
            f"identification has not seen; {POSTURES} are needed. Use a wider task_workspace in rig.toml, or another "
            "--seed."
        )
    return in_short_order(found[:POSTURES], description.donning_posture)


def both_ways(q: Joints, towards: Joints, dt: float) -> Trajectory:
    """Return a pass along a line through `q` [rad] and back; `towards` is ±1 for each joint."""
    return motion.there_and_back(q - REACH_RAD * towards, q + REACH_RAD * towards, SPEED_RAD_S, dt)


def visits(postures: Postures, seed: int, dt: float) -> Iterator[tuple[int, Trajectory]]:
    """Yield the passes in their order, each with the index of its posture."""
    random = np.random.default_rng([seed, 13])
    for visit in range(ROUNDS * len(postures)):
        k = visit % len(postures)
        yield k, both_ways(postures[k], random.choice([-1.0, 1.0], size=postures.shape[1]), dt)


@dataclass(frozen=True)
class Verification:
    """Postures of a verification, and the seed of the directions."""

    postures: Postures
    """Postures at which the passes measure the left over [rad]."""
    seed: int


@dataclass(frozen=True)
class VerificationPasses:
    """Trajectory of all passes, one after the other."""

    path: Trajectory
    posture: Int[np.ndarray, " tick"]
    """Posture index of the pass of each tick; `NONE` between passes."""


def all_passes(postures: Postures, seed: int, start: Joints, dt: float) -> VerificationPasses:
    """Return the trajectory from `start` [rad] through all postures, in both directions."""
    parts, of, here = [], [], start
    for k, path in visits(postures, seed, dt):
        way = motion.go_to(here, path.q[0], TRAVEL_RAD_S, dt)
        parts += [way, path]
        of += [np.full(len(way), NONE), np.full(len(path), k)]
        here = path.q[-1]
    return VerificationPasses(motion.joined(parts), np.concatenate(of))


def _spread(description: RigDescription, seed: int) -> Postures:
    lower, upper = description.workspace
    narrow = [name for name, room in zip(description.joints, upper - lower, strict=True) if room <= 2 * REACH_RAD]
    if narrow:
        raise ModelError(
            f"task_workspace of {description.name} gives {narrow[0]} a range of {np.rad2deg(2 * REACH_RAD):.0f}° or "
            "less; a pass needs more. Widen it in rig.toml."
        )
    # The sequence is scrambled by the seed, so it differs from the postures of the stop rule and of comparisons.
    points = sobol_points(len(lower), CANDIDATES, np.random.default_rng([seed, 12]))
    return lower + REACH_RAD + points * (upper - lower - 2 * REACH_RAD)


def _is_unseen(q: Joints, seen: Float[np.ndarray, "tick joint"]) -> bool:
    return float(np.abs(seen - q).max(axis=1).min()) > UNSEEN_RAD


def _is_clear(model: ArmModel, q: Joints, x: Parameters) -> bool:
    model.at_rest(q, x)
    moving = np.full(len(q), SPEED_RAD_S)
    return bool((model.direction_uncertainty(moving) < 0.5 * SINGULAR_SD).all())
