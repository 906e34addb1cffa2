"""Strength of the pull on a guided arm: a spring and a damper towards the target, with a bounded torque."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.control.tick import FAR_DAMPING_S, FAR_RAD_S
from exograv.model.description import RigDescription
from exograv.signals import Reference

Joints = Float[np.ndarray, " joint"]

BOUND_NM = {"shoulder": 3.0, "elbow": 2.0, "wrist": 0.5}
"""Largest torque of the pull by place [N·m]: less than a weak adult resists (docs/explanation/safety.md), and no more
than the guard leaves beside the arm's weight in any posture."""

REACH_RAD = np.deg2rad(10.0)
"""Error at which the spring alone reaches its bound [rad]."""


@dataclass(frozen=True)
class PullStrength:
    """Strength of the pull, one entry per joint."""

    bound: Joints
    """Largest torque of spring and damper together [N·m]."""

    kp: Joints
    """Stiffness of the spring [N·m/rad]."""

    kd: Joints
    """Damping of the pull [N·m·s/rad]."""

    tick_kp: Joints
    tick_kd: Joints
    """Gains of the control law that applies the pull; units as `kp` and `kd`."""

    @classmethod
    def of(cls, description: RigDescription) -> "PullStrength":
        """Choose the strength by the machine's places, with the damping of its rig file, which does not ring."""
        bound = np.array([BOUND_NM[place] for place in description.places])
        tick_kp, tick_kd = (description.per_actuator(f"weak_{name}") for name in ("kp_Nm_per_rad", "kd_Nms_per_rad"))
        return cls(bound, np.minimum(bound / REACH_RAD, tick_kp), tick_kd, tick_kp, tick_kd)

    def torque(self, q: Joints, v: Joints, target: Reference, grip: Joints | float) -> Joints:
        """Pull [N·m] at joint position `q` [rad] and velocity `v` [rad/s], with `grip`, 0 to 1, of the strength."""
        wanted = self.kp * (target.q - q) + self.kd * (target.v - v)
        return grip * np.clip(wanted, -self.bound, self.bound)

    def stored(self, error: Joints) -> float:
        """Energy of the spring at an error [rad] and full grip [J]: quadratic up to its bound, then linear."""
        off, knee = np.abs(error), self.bound / self.kp
        return float(np.where(off < knee, 0.5 * self.kp * off**2, self.bound * (off - 0.5 * knee)).sum())

    def reference(self, q: Joints, v: Joints, target: Reference, tau: Joints) -> Reference:
        """Return the reference with which the control law's feedback is exactly the torque `tau` [N·m].

        The feed-forward (inertia and friction) is that of the target's motion.
        """
        return Reference(q + (tau - self._tick_damping(target.v - v)) / self.tick_kp, target.v, target.a)

    def _tick_damping(self, dv: Joints) -> Joints:
        """Damping torque of the control law (`control.tick.weak_damping`) at a velocity difference [rad/s]."""
        far = dv - np.clip(dv, -FAR_RAD_S, FAR_RAD_S)
        return self.tick_kd * dv + np.maximum(FAR_DAMPING_S * self.tick_kp - self.tick_kd, 0.0) * far
