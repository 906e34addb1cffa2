"""How hard an arm is led: a spring and a damper towards where it should be, whose torque has a bound."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.signals import Reference

Joints = Float[np.ndarray, " joint"]

BOUND_NM = {"shoulder": 3.0, "elbow": 2.0, "wrist": 0.5}
"""Less than a weak adult resists (docs/safety.md), and no more than the guard leaves beside carrying in any posture."""

REACH_RAD = np.deg2rad(10.0)
"""Error at which the spring alone is at its bound."""


@dataclass(frozen=True)
class PullStrength:
    """Of the pull, one entry per joint."""

    bound: Joints
    """Largest torque of spring and damper together [N·m]."""

    kp: Joints
    """[N·m/rad]"""

    kd: Joints
    """[N·m·s/rad]"""

    tick_kp: Joints
    tick_kd: Joints
    """Of the control law, through which the pull goes; as `kp` and `kd`."""

    @classmethod
    def of(cls, description: RigDescription) -> "PullStrength":
        """By the machine's places; damped as its rig file found it not to ring."""
        bound = np.array([BOUND_NM[place] for place in description.places])
        tick_kp, tick_kd = (description.per_actuator(f"weak_{name}") for name in ("kp_Nm_per_rad", "kd_Nms_per_rad"))
        return cls(bound, np.minimum(bound / REACH_RAD, tick_kp), tick_kd, tick_kp, tick_kd)

    def torque(self, q: Joints, v: Joints, target: Reference, grip: Joints | float) -> Joints:
        """Pull [N·m] on joints at `q` [rad] that move with `v` [rad/s], at a share `grip` of its strength, 0 to 1."""
        wanted = self.kp * (target.q - q) + self.kd * (target.v - v)
        return grip * np.clip(wanted, -self.bound, self.bound)

    def stored(self, error: Joints) -> float:
        """Energy of the spring alone, at an error [rad] and full grip [J]: quadratic, and from its bound on linear."""
        off, knee = np.abs(error), self.bound / self.kp
        return float(np.where(off < knee, 0.5 * self.kp * off**2, self.bound * (off - 0.5 * knee)).sum())

    def reference(self, q: Joints, v: Joints, target: Reference, tau: Joints) -> Reference:
        """What to give the control law, so that its feedback is this torque `tau` [N·m] and nothing more.

        Its feed-forward, inertia and friction, is that of the target's motion.
        """
        return Reference(q + (tau - self.tick_kd * (target.v - v)) / self.tick_kp, target.v, target.a)
