"""Check at the end of an identification: a tour through postures that the motion before left out."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.identification.excitation.limits import A_MAX, V_MAX
from exograv.model.description import RigDescription
from exograv.motion import Trajectory
from exograv.sobol import sobol_points

CHECK_S = 10.0
"""Duration of the tour [s]."""

CHECKED_FROM_S = 40.0
"""Shortest motion that ends with a check [s]: the tour then takes at most a quarter of it."""

ORDER = (0, 1, 2, 3, 1, 3, 0, 2)
"""Order of the visits. Each posture is visited twice, each time from another posture, because friction and hysteresis
depend on the way. Two visits of one posture are some seconds apart, because the wearer's slow torque lasts so long."""

CANDIDATES = 64
CANDIDATES_SEED = 31
FARTHEST = 24
"""Number of candidates, the farthest from the motion, from which postures far from each other are chosen."""

ROOM = 0.1
"""Distance of a posture from the edge of the task workspace, as a share of the workspace [-]."""

PEAK_V, PEAK_A = 1.875, 5.774
"""Peak velocity and acceleration of a minimum-jerk motion, over those of constant speed [-]: 15/8 and 10/√3."""

Joints = Float[np.ndarray, " joint"]
Postures = Float[np.ndarray, "posture joint"]


@dataclass(frozen=True)
class PlannedCheck:
    """Check at the end of a motion."""

    from_s: float
    """Time of motion at which the check begins [s]."""

    postures: Postures
    """Postures of the check, in the order of the first visits [rad]."""


def excitation_s(seconds: float) -> float:
    """Duration of the motion before the check [s]; the whole duration of a motion without a check."""
    return seconds - CHECK_S if seconds >= CHECKED_FROM_S else seconds


def unused_postures(description: RigDescription, seen: Float[np.ndarray, "tick joint"]) -> Postures:
    """Return postures of the task workspace far from the postures `seen` [rad] and from each other."""
    lower, upper = description.workspace
    points = sobol_points(len(lower), CANDIDATES, np.random.default_rng(CANDIDATES_SEED))
    candidates = lower + (ROOM + (1.0 - 2.0 * ROOM) * points) * (upper - lower)
    distance = np.array([np.abs(seen - q).max(axis=1).min() for q in candidates])
    left = list(candidates[np.argsort(-distance)[:FARTHEST]])
    chosen = [left.pop(0)]
    while len(chosen) < max(ORDER) + 1:
        apart = [min(np.abs(q - one).max() for one in chosen) for q in left]
        chosen.append(left.pop(int(np.argmax(apart))))
    return in_short_order(chosen, seen[-1])


def check_tour(start: Joints, postures: Postures, dt: float) -> Trajectory:
    """Return the tour from rest at `start` through the postures [rad] in `ORDER`, within `CHECK_S`.

    Where the legs are too long for the limits of speed and acceleration, the tour goes through postures nearer to their
    middle.
    """
    middle, share = postures.mean(axis=0), 1.0
    stops, seconds = [start], np.zeros(0)
    while share > 0.0:
        stops = [start, *(middle + share * (postures[k] - middle) for k in ORDER)]
        ways = np.abs(np.diff(stops, axis=0)).max(axis=1)
        seconds = np.maximum(np.maximum(PEAK_V * ways / V_MAX, np.sqrt(PEAK_A * ways / A_MAX)), 20 * dt)
        if seconds.sum() <= CHECK_S:
            break
        share -= 0.05
    ends = np.round(np.cumsum(seconds) * CHECK_S / seconds.sum() / dt)
    ticks = np.diff(ends, prepend=0.0)
    legs = zip(stops, stops[1:], ticks, strict=False)
    return motion.joined([motion.minimum_jerk(a, b, float(n) * dt, dt) for a, b, n in legs])


def in_short_order(postures: Sequence[Joints], start: Joints) -> Postures:
    """Return the postures [rad] in the order in which each is the nearest to the one before, from `start` on."""
    left, ordered, here = list(postures), [], start
    while left:
        here = left.pop(int(np.argmin([np.abs(q - here).max() for q in left])))
        ordered.append(here)
    return np.array(ordered)
