"""Where it is asked what is left over: postures of the task workspace that nobody has learned from."""

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

POSTURES = 12
CANDIDATES = 64
UNSEEN_RAD = 0.15
"""A posture is unseen where the identification's motion was never so near with all joints at once [rad]."""

REACH_RAD = 0.2
"""A pass leads from so far on one side of its posture to as far on the other, with every joint [rad]."""

SPEED_RAD_S = 0.25
"""Of a pass: slow, so that inertia and damping say nothing, and quick enough that every joint slides [rad/s]."""


ROUNDS = 2
"""Through all postures, in the same order: a minute apart the wearer's slow torque is another one, and what comes back
at a posture is not his."""

NONE = -1
"""In no posture's pass."""

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "posture joint"]


def unseen_postures(model: ArmModel, x: Parameters, seen: Float[np.ndarray, "tick joint"], seed: int) -> Postures:
    """`POSTURES` of a seed, spread over the workspace, with room for a pass about each, in a short order [rad].

    Args:
        model: Of the arm in its machine; a posture near a singular one of the arm is left out.
        x: The arm as known.
        seen: Where the identification's motion led [rad].
        seed: Of the postures alone: the same seed asks again at the same ones.

    Raises:
        ModelError: The task workspace has no room for them.
    """
    description = model.assembly.description
    found = [q for q in _spread(description, seed) if _is_unseen(q, seen) and _is_clear(model, q, x)]
    if len(found) < POSTURES:
        raise ModelError(
            f"{description.name} has {len(found)} postures of {CANDIDATES} in its task workspace that the "
            f"identification has not seen; {POSTURES} are needed. Take a wider task_workspace in rig.toml, or another "
            "--seed."
        )
    return _in_short_order(np.array(found[:POSTURES]), description.donning_posture)


def both_ways(q: Joints, towards: Joints, dt: float) -> Trajectory:
    """Past `q` [rad] along a line and back; `towards` is ±1 for each joint."""
    return motion.there_and_back(q - REACH_RAD * towards, q + REACH_RAD * towards, SPEED_RAD_S, dt)


def visits(postures: Postures, seed: int, dt: float) -> Iterator[tuple[int, Trajectory]]:
    """The passes in their order, each with the posture that it is past."""
    random = np.random.default_rng([seed, 13])
    for visit in range(ROUNDS * len(postures)):
        k = visit % len(postures)
        yield k, both_ways(postures[k], random.choice([-1.0, 1.0], size=postures.shape[1]), dt)


@dataclass(frozen=True)
class Verification:
    """Where it is asked, and in which directions."""

    postures: Postures
    """[rad]"""
    seed: int


@dataclass(frozen=True)
class VerificationPasses:
    """All of them, one after the other."""

    path: Trajectory
    posture: Int[np.ndarray, " tick"]
    """In whose pass a tick is; `NONE` on the way to one."""


def all_passes(postures: Postures, seed: int, start: Joints, dt: float) -> VerificationPasses:
    """From `start` [rad] to each posture and past it in both directions."""
    parts, of, here = [], [], start
    for k, path in visits(postures, seed, dt):
        way = motion.go_to(here, path.q[0], TRAVEL_RAD_S, dt)
        parts += [way, path]
        of += [np.full(len(way), NONE), np.full(len(path), k)]
        here = path.q[-1]
    return VerificationPasses(motion.joined(parts), np.concatenate(of))


def _spread(description: RigDescription, seed: int) -> Postures:
    from scipy.stats import qmc  # 0.3 s that no tick has to wait for

    lower, upper = description.workspace
    narrow = [name for name, room in zip(description.joints, upper - lower, strict=True) if room <= 2 * REACH_RAD]
    if narrow:
        raise ModelError(
            f"task_workspace of {description.name} leaves {narrow[0]} no more than {np.rad2deg(2 * REACH_RAD):.0f}°; a "
            "pass needs more. Widen it in rig.toml."
        )
    # Scrambled by the seed: neither the postures of the stop rule nor those that identifications are compared at.
    sobol = qmc.Sobol(d=len(lower), scramble=True, rng=np.random.default_rng([seed, 12]))
    return lower + REACH_RAD + sobol.random(CANDIDATES) * (upper - lower - 2 * REACH_RAD)


def _is_unseen(q: Joints, seen: Float[np.ndarray, "tick joint"]) -> bool:
    return float(np.abs(seen - q).max(axis=1).min()) > UNSEEN_RAD


def _is_clear(model: ArmModel, q: Joints, x: Parameters) -> bool:
    model.at_rest(q, x)
    moving = np.full(len(q), SPEED_RAD_S)
    return bool((model.direction_uncertainty(moving) < 0.5 * SINGULAR_SD).all())


def _in_short_order(postures: Postures, start: Joints) -> Postures:
    left, ordered, here = list(postures), [], start
    while left:
        nearest = int(np.argmin([np.abs(q - here).max() for q in left]))
        here = left.pop(nearest)
        ordered.append(here)
    return np.array(ordered)
