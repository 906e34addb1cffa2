"""Passive torques of the relaxed arm: elastic joints, hysteresis, end stops, and a shoulder centre that shifts."""

from dataclasses import dataclass

import casadi as ca
import numpy as np

from .curved_path import SHIFT_AT_90, CurvedPath
from .relaxation import RelaxationMode
from .shoulder_path import ShoulderPath
from .skeleton import Skeleton
from .wearer import PassiveJoints, Wearer

HYSTERESIS_DECAY = 1.0
"""Time constant of the hysteresis [s].

Source: a major part decays within 1 s, MacKay (1986), J Biomech 19:231, abstract.
"""

# The torque rises from zero, 15° before the end, to its value at the end, over four e-folds.
STOP_ZONE = np.deg2rad(15.0)
STOP_FOLDS = 4.0
# Behind the end the exponential is limited: at six e-folds it is already seven times as strong, which no wearer
# exceeds.
STOP_FOLDS_MAX = 6.0

SHIFT_TABLE = np.array([[30.0, 12.0], [60.0, 25.0], [90.0, 39.0], [120.0, 54.0], [150.0, 70.0]])
"""Shift of the shoulder centre from rest [mm] at an elevation [°].

Computed from a published model of the motion of clavicle and scapula with the arm (unverified).
"""

# Near the hanging arm, elevation has a corner, because every direction away from it is upwards. A radius of 0.1 rad
# rounds the corner; otherwise the reaction torque would jump.
CORNER = 0.1
SHIFT_STIFFNESS = 2.0e5
"""Stiffness that holds the shoulder centre on its path: 40 N move it by 0.2 mm [N/m].

A stiffer spring is not better: the shoulder end of an arm has an effective mass of only a few hundred grams in some
postures. Explicit forces are stable only while damping · step / mass + stiffness · step² / (2 · mass) stays below 2.
"""

SHIFT_DAMPING = 2.0e2
"""Damping of the shoulder centre on its path [N·s/m]."""


@dataclass(frozen=True)
class PassiveTorque:
    """Torque of the relaxed joints and the new state of the hysteresis."""

    tau: ca.SX
    """Passive torque (arm,) [N·m]."""

    hysteresis_next: ca.SX
    """Angles to which the fast parts of the elasticity have relaxed (arm, mode) [rad]."""


def passive_torque(
    joints: PassiveJoints, q: ca.SX, v: ca.SX, hysteresis: ca.SX, dt: float, crept: ca.SX | None = None
) -> PassiveTorque:
    """Passive torque of the arm's joints at `q`, `v` (arm,): elasticity, damping, hysteresis and end stops.

    `hysteresis` (arm, mode) has one column for each `RelaxationMode` of the joints [rad]. `crept` (arm,) is the angle
    by which the rest posture has moved [rad]; None if the rest posture does not creep.
    """
    tau = elastic_torque(joints, q, crept) - ca.DM(joints.damping) * v
    fast = joints.hysteresis * ca.DM(joints.stiffness)
    relaxed = []
    for (share, decay), part in zip(relaxation(joints), ca.horzsplit(hysteresis), strict=True):
        relaxed.append(part + (q - part) * (1.0 - np.exp(-dt / decay)))
        tau = tau - share * fast * (q - part)
    return PassiveTorque(tau, ca.horzcat(*relaxed))


def relaxation(joints: PassiveJoints) -> tuple[RelaxationMode, ...]:
    """Modes by which the fast part of the elasticity relaxes, one at home."""
    return (RelaxationMode(1.0, HYSTERESIS_DECAY),) if joints.tissue is None else joints.tissue.relaxation


def elastic_torque(joints: PassiveJoints, q: ca.SX, crept: ca.SX | None = None) -> ca.SX:
    """Passive torque of the relaxed joints at rest, when the hysteresis has decayed (arm,) [N·m]."""
    angle = q - ca.DM(joints.neutral)
    if joints.tissue is None:
        tau = -ca.DM(joints.stiffness) * angle
    else:
        tau = -joints.tissue.torque(joints.stiffness, angle if crept is None else angle - crept)
    if not joints.stop.any():
        return tau
    (low, high), stop = joints.range.T, ca.DM(joints.stop)
    return tau + _stop(stop, ca.DM(low) + STOP_ZONE - q) - _stop(stop, q - (ca.DM(high) - STOP_ZONE))


def follower_paths(wearer: Wearer, q: ca.SX) -> ca.SX:
    """Positions of all joints that follow the arms' posture `q` (arm,) on their paths (follower,) [m, rad].

    For each arm: the shifts of its shoulder centre, if it has any, then the joints that are coupled to its freedoms.
    """
    paths, start = [], 0
    for arm in wearer.arms:
        skeleton = arm.skeleton
        own = q[start : start + len(skeleton.freedoms)]
        if skeleton.follows_elevation:
            paths.extend(shoulder_shifts(skeleton, own, wearer.glenohumeral_share, wearer.shoulder_path))
        for coupling in skeleton.couplings:
            angle = own[skeleton.freedoms.index(coupling.freedom)]
            paths.append(ca.polyval(ca.DM(coupling.polynomial[::-1]), angle))
        start += len(skeleton.freedoms)
    return ca.vertcat(*paths)


def elevation_cosine(skeleton: Skeleton, q: ca.SX) -> ca.SX:
    """Cosine of the angle between the upper arm and the hanging upper arm, at the posture `q` (arm,) of one arm."""
    if skeleton.is_usual:
        return ca.cos(q[0]) * ca.cos(q[1])
    return _upper_arm_line(skeleton, q)[2]


def _upper_arm_line(skeleton: Skeleton, q: ca.SX) -> ca.SX:
    """Return the unit direction (3,) from the elbow to the shoulder."""
    along = ca.SX([0.0, 0.0, 1.0])
    for joint in reversed(skeleton.shoulder_joints):
        along = _turned(ca.SX(joint.axis), q[skeleton.freedoms.index(joint.name)], along)
    return along


def shoulder_shift(skeleton: Skeleton, q: ca.SX, share: float, path: ShoulderPath | None = None) -> ca.SX:
    """Distance that the shoulder centre has moved on its path at the posture `q` (arm,) of one arm [m].

    The path leads up and inwards at home, and in another direction in a world that has a `path` of its own.
    """
    chord = _chord(skeleton, q)
    powers = np.arange(1, len(SHIFT_TABLE) + 1)
    # A polynomial without constant goes through the table. Its variable is the chord of the elevation, which is smooth
    # where the angle is not.
    at_table = np.sqrt(2.0 * (1.0 - np.cos(np.deg2rad(SHIFT_TABLE[:, 0]))) + CORNER**2) - CORNER
    coefficients = np.linalg.solve(at_table[:, None] ** powers, 1e-3 * SHIFT_TABLE[:, 1])
    shift = ca.SX(0)
    for coefficient in coefficients[::-1]:
        shift = (shift + float(coefficient)) * chord
    if path is None:
        return share * shift
    forward = -_upper_arm_line(skeleton, q)[0]
    return (share + path.by_plane * forward) * shift


def shoulder_shifts(
    skeleton: Skeleton, q: ca.SX, share: float, path: ShoulderPath | CurvedPath | None = None
) -> tuple[ca.SX, ...]:
    """Distances that the shoulder centre has moved in each direction of its path, at the posture `q` of one arm [m]."""
    if isinstance(path, CurvedPath):
        return curved_shifts(skeleton, q, path)
    return (shoulder_shift(skeleton, q, share, path),)


def curved_shifts(skeleton: Skeleton, q: ca.SX, path: CurvedPath) -> tuple[ca.SX, ca.SX]:
    """Distances that the shoulder centre has moved along and across a curved path, at a posture `q` of one arm [m]."""
    at_90 = 2.0 * np.arcsin(0.5 * (np.sqrt(2.0 + CORNER**2) - CORNER))
    elevation = 2.0 * ca.asin(0.5 * _chord(skeleton, q)) / at_90
    forward = -_upper_arm_line(skeleton, q)[0]
    along, across = (
        ((1.0 - b - c) + (b + c * elevation) * elevation) * elevation for b, c in (path.along, path.across)
    )
    return path.share * SHIFT_AT_90 * along, path.across_m * across + path.by_plane_m * forward


def _chord(skeleton: Skeleton, q: ca.SX) -> ca.SX:
    """Chord of the elevation on the unit circle, rounded near the hanging arm [-]."""
    return ca.sqrt(2.0 * (1.0 - elevation_cosine(skeleton, q)) + CORNER**2) - CORNER


@dataclass(frozen=True)
class LateShift:
    """Place of a shoulder's centre, in one direction, that follows the arm with a lag."""

    place: ca.SX
    """Present place on the path [m]."""

    speed: ca.SX
    """Present speed along the path [m/s]."""

    next: ca.SX
    """Next states: the place one step later [m], and in a path with inertia its speed [m/s]."""


def late_shift(shift: ca.SX, place: ca.SX, path: ShoulderPath, dt: float) -> LateShift:
    """Follow `shift` [m] from the present `place` [m] over one step `dt` [s], by a first-order lag."""
    return LateShift(place, (shift - place) / path.lag, place + (shift - place) * (1.0 - np.exp(-dt / path.lag)))


def swinging_shift(shift: ca.SX, state: ca.SX, path: CurvedPath, dt: float) -> LateShift:
    """Follow `shift` [m] from the present place and speed (1, 2) over one step `dt` [s], as an oscillator."""
    place, speed = ca.horzsplit(state)
    rise = path.frequency**2 * (shift - place) - 2.0 * path.damping_ratio * path.frequency * speed
    faster = speed + dt * rise
    return LateShift(place, speed, ca.horzcat(place + dt * faster, faster))


def shift_forces(
    shift: ca.SX, q: ca.SX, v: ca.SX, x: ca.SX, v_x: ca.SX, late: LateShift | None = None
) -> tuple[ca.SX, ca.SX]:
    """Force along the shoulder's path [N] and its reaction on the arm's joints (arm,) [N·m].

    Args:
        shift: Position of the centre on its path, as an expression of `q` [m].
        q: Posture of the arm (arm,) [rad].
        v: Velocity of the arm (arm,) [rad/s].
        x: Present position of the centre [m].
        v_x: Present velocity of the centre [m/s].
        late: Place and speed on the path to which the girdle has brought the centre, where it lags.
    """
    slope = ca.gradient(shift, q)
    if late is None:
        force = -SHIFT_STIFFNESS * (x - shift) - SHIFT_DAMPING * (v_x - ca.dot(slope, v))
    else:
        force = -SHIFT_STIFFNESS * (x - late.place) - SHIFT_DAMPING * (v_x - late.speed)
    return force, -slope * force


def _turned(axis: ca.SX, angle: ca.SX, vector: ca.SX) -> ca.SX:
    """Vector (3,) turned about an axis (3,) by an angle [rad], with Rodrigues' formula."""
    across = ca.cross(axis, vector)
    return ca.cos(angle) * vector + ca.sin(angle) * across + (1.0 - ca.cos(angle)) * ca.dot(axis, vector) * axis


def _stop(stop: ca.DM, depth: ca.SX) -> ca.SX:
    """Torque magnitude (arm,) [N·m] at a depth (arm,) [rad] into the zones of end stops."""
    folds = ca.fmin(STOP_FOLDS * ca.fmax(depth, 0.0) / STOP_ZONE, STOP_FOLDS_MAX)
    return stop * (ca.exp(folds) - 1.0) / (np.exp(STOP_FOLDS) - 1.0)
