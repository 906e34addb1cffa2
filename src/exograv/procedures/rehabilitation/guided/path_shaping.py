"""Shaping of a taught path: the measured motion is trimmed, smoothed, checked and slowed until it may be repeated."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from exograv.errors import ConfigError
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.motion import Trajectory
from exograv.safety.limits import PersonLimits

Joints = Float[np.ndarray, " joint"]
Rows = Float[np.ndarray, "row joint"]

PERIOD_S = 0.04
"""Time between two postures of a stored path [s]. Smoothing leaves only motion below 3 Hz."""

SMOOTH_S = 0.12
"""Standard deviation of the Gaussian filter over the postures [s]. It removes tremor and keeps turns."""

V_MAX_RAD_S, A_MAX_RAD_S2 = 1.0, 3.0
"""Largest speed [rad/s] and acceleration [rad/s²] of any joint on a path; identification moves a person at 1.5 rad/s
(assumed)."""

STARTS_RAD = np.deg2rad(1.5)
"""Distance from the first posture at which the arm is being led [rad]."""

MORE_S = 0.5
"""Time that is kept before and after the detected motion [s], since a movement begins and ends slowly."""

SHORTEST_RAD, LONGEST_S = np.deg2rad(5.0), 120.0
"""Least motion [rad] and greatest duration [s] of a path."""

EDGE_RAD = 1e-4
"""Tolerance of the bounds [rad]: a stored path is rounded."""

QUICKER = 1.1
"""Factor by which a path's table may exceed the allowed speed, between its rows and at its ends [-]."""

OUTSIDE_RAD = np.deg2rad(5.0)
"""Allowed distance beyond the task workspace [rad]: its edge cannot be felt by hand."""


@dataclass(frozen=True)
class ShapedPath:
    """Path that may be repeated."""

    q: Rows
    """Postures every `PERIOD_S` [rad]."""

    stretched: float
    """Ratio of the path's duration to that of the therapist's motion, at least 1 [-]."""


def shaped(q: Rows, dt: float, description: RigDescription, exo: Tree) -> ShapedPath:
    """Return the path of measured postures.

    Args:
        q: Measured postures, from before the motion until after it [rad].
        dt: Time between two postures [s].
        description: Description of the machine.
        exo: Tree of the machine, with the joints' limits.

    Raises:
        ConfigError: The motion is too small or too long, or leaves the range of machine and person; the message says
            where.
    """
    if not np.isfinite(q).all():
        raise ConfigError("Some measured positions are missing, so no path was kept. Teach the path again.")
    # Smoothed before the cut, so that an end has no tremor, and after it, so that the path ends at rest.
    q = _smooth(q, dt)
    off = np.abs(q - q[0]).max(axis=1) > STARTS_RAD
    away = np.abs(q - q[-1]).max(axis=1) > STARTS_RAD
    if not off.any() or float(np.ptp(q, axis=0).max()) < SHORTEST_RAD:
        farthest = np.rad2deg(np.ptp(q, axis=0).max())
        raise ConfigError(
            f"The arm was moved by {farthest:.1f}° at most; a path needs {np.rad2deg(SHORTEST_RAD):.0f}°. "
            "Teach it again."
        )
    begin, end = int(np.argmax(off)), len(q) - int(np.argmax(away[::-1]))
    pad, more = round(4.0 * SMOOTH_S / dt), round(MORE_S / dt)
    led = np.pad(q[max(begin - more, 0) : end + more], ((pad, pad), (0, 0)), mode="edge")
    smooth = _smooth(led, dt)
    t = np.arange(len(smooth)) * dt
    if t[-1] > LONGEST_S:
        raise ConfigError(f"The arm was led for {t[-1]:.0f} s; a path may have {LONGEST_S:.0f} s. Teach a shorter one.")
    refuse_outside(smooth, t, description, exo)
    v = np.abs(np.gradient(smooth, dt, axis=0))
    a = np.abs(np.gradient(np.gradient(smooth, dt, axis=0), dt, axis=0))
    allowed = speed_limits(exo)
    stretched = max(1.0, float((v / allowed).max()), float(np.sqrt(a.max() / A_MAX_RAD_S2)))
    t *= stretched
    rows = np.linspace(0.0, t[-1], max(round(t[-1] / PERIOD_S), 2) + 1)
    # The last row is at the end of the path, so the period differs from `PERIOD_S` by less than one row in total.
    return ShapedPath(CubicSpline(t, smooth)(rows), stretched)


def _smooth(q: Rows, dt: float) -> Rows:
    """Apply one of two passes of the filter; both together have the width `SMOOTH_S`."""
    return np.asarray(gaussian_filter1d(q, SMOOTH_S / np.sqrt(2.0) / dt, axis=0, mode="reflect"))


def refuse_outside(q: Rows, t: Float[np.ndarray, " row"], description: RigDescription, exo: Tree) -> None:
    """Refuse a path that enters the walls before a joint's stops, or leaves the task workspace.

    Raises:
        ConfigError: A posture is outside; the message names joint, time, angle and allowed range.
    """
    lower, upper = allowed_range(description, exo)
    beyond = np.maximum(lower - q, q - upper)
    if beyond.max() <= EDGE_RAD:
        return
    row, joint = (int(k) for k in np.unravel_index(int(np.argmax(beyond)), beyond.shape))
    at, least, most = np.rad2deg([q[row, joint], lower[joint], upper[joint]])
    first = float(t[int(np.argmax((beyond > 0.0).any(axis=1)))])
    raise ConfigError(
        f"The path cannot be repeated: {description.joints[joint]} reaches {at:.0f}° at {t[row]:.1f} s (first outside "
        f"at {first:.1f} s); allowed are {least:.0f}° to {most:.0f}°, inside the task workspace and clear of the "
        "joint's stops. Lead the arm again and stay inside."
    )


def allowed_range(description: RigDescription, exo: Tree) -> tuple[Joints, Joints]:
    """Lower and upper limits of a guided joint [rad]: the task workspace, clear of the walls before the stops."""
    wall = np.array([PersonLimits.wall_rad] * len(exo.joints))
    stops = np.array([(joint.lower, joint.upper) for joint in exo.joints]).T
    space_lower, space_upper = description.workspace
    lower = np.maximum(stops[0] + wall, space_lower - OUTSIDE_RAD)
    upper = np.minimum(stops[1] - wall, space_upper + OUTSIDE_RAD)
    # In some machines the posture of donning is closer to a stop than the wall reaches.
    lower = np.minimum(lower, description.donning_posture - OUTSIDE_RAD)
    upper = np.maximum(upper, description.donning_posture + OUTSIDE_RAD)
    return lower, upper


def speed_limits(exo: Tree) -> Joints:
    """Largest speeds of the joints on a path [rad/s]."""
    return np.minimum(V_MAX_RAD_S, 0.5 * np.array([joint.velocity for joint in exo.joints]))


def refuse_quick(path: Trajectory, description: RigDescription, exo: Tree) -> None:
    """Refuse a path that is faster than any shaped path.

    Raises:
        ConfigError: A joint is too fast; the message names joint, speed and limit.
    """
    for of, allowed, unit in ((path.v, speed_limits(exo), "rad/s"), (path.a, A_MAX_RAD_S2, "rad/s²")):
        most = np.abs(of).max(axis=0)
        joint = int(np.argmax(most / allowed))
        limit = float(np.broadcast_to(allowed, most.shape)[joint])
        if most[joint] > QUICKER * limit:
            raise ConfigError(
                f"The path cannot be repeated: {description.joints[joint]} would move with {most[joint]:.2f} {unit}; "
                f"allowed: {limit:.2f}. Teach it again: `exograv run teach` slows a path that is too fast."
            )


def driven(q: Rows, period_s: float, dt: float) -> Trajectory:
    """Return a stored path at the loop's period, from rest to rest."""
    t = np.arange(len(q)) * period_s
    spline = CubicSpline(t, q, bc_type="clamped")
    ticks = np.linspace(0.0, t[-1], round(t[-1] / dt) + 1)
    return Trajectory(spline(ticks), spline(ticks, 1), spline(ticks, 2), dt)
