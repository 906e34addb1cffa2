"""Standard excitation motions of the literature: D-optimal harmonics, and one joint after another."""

from exograv import motion
from exograv.motion import Trajectory

from .basis import Basis, harmonic
from .limits import MotionLimits

STANDARD_HARMONICS = 5
FIXED_PERIOD_S = 20.0


def standard_basis(period_s: float) -> Basis:
    """Basis of five harmonics.

    Source: Swevers 1997, IEEE T-RA 13:730.
    """
    return harmonic(period_s, STANDARD_HARMONICS)


def fixed_motion(limits: MotionLimits, seconds: float, dt: float) -> Trajectory:
    """Repeated motion of one joint after another through its range and back, with the others in the middle."""
    middle = 0.5 * (limits.lower + limits.upper)
    parts, joints = [], len(middle)
    for joint in range(joints):
        way = float(limits.upper[joint] - limits.lower[joint])
        # To one end, to the other, and back: twice the range in the joint's share of the period.
        speed = min(float(limits.v_max[joint]), 2.0 * way / (FIXED_PERIOD_S / joints))
        goals = (float(limits.upper[joint]), float(limits.lower[joint]))
        parts += [motion.sweep(middle, joint, goal, speed, dt) for goal in goals]
    period = motion.joined(parts)
    whole = motion.joined([period] * (1 + int(seconds / period.seconds)))
    ticks = round(seconds / dt)
    return Trajectory(whole.q[:ticks], whole.v[:ticks], whole.a[:ticks], dt)
