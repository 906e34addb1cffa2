"""Limits of an excitation motion, for a relaxed wearer and for the machine."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.model.arm import COMFORT_DEG
from exograv.model.assembly import Assembly
from exograv.model.limb import FREEDOMS
from exograv.model.loops import NEAR_SINGULAR

V_MAX, A_MAX = 1.2, 4.0  # rad/s, rad/s²: gentle for a relaxed arm
TORQUE_SHARE = 0.7  # of the rated torque: a person may be 25 % heavier than the table says
MARGIN_DEG = {"shoulder": 12.0, "elbow": 12.0, "wrist": 6.0}
"""Angle by which the motion goes beyond the task workspace [°], by place of the joint.

The larger motion lets the estimator separate elasticity from weight.
"""
OFF_STOPS_RAD = np.deg2rad(
    8.0
)  # distance from the machine's own limits: the soft position control allows tracking errors

Joints = Float[np.ndarray, " joint"]
Freedoms = Float[np.ndarray, " freedom"]


@dataclass(frozen=True)
class MotionLimits:
    """Limits of the machine's joints and of the arm."""

    lower: Joints
    """Smallest joint positions [rad]."""

    upper: Joints
    """Largest joint positions [rad]."""

    v_max: Joints
    """Largest joint speeds [rad/s]."""

    a_max: Joints
    """Largest joint accelerations [rad/s²]."""

    tau_max: Joints
    """Largest torque that the machine may need with a nominal person [N·m]."""

    z_lower: Freedoms
    """Smallest arm angles: comfortable, and away from the singular posture [rad]."""

    z_upper: Freedoms
    """Largest arm angles [rad]."""

    @classmethod
    def of(cls, assembly: Assembly) -> "MotionLimits":
        """Limits around the task workspace, inside the machine's limits and the person's comfort range."""
        description, joints = assembly.description, assembly.exo.joints
        margin = np.deg2rad([MARGIN_DEG[place] for place in description.places])
        lower, upper = description.workspace
        z_lower, z_upper = _comfort(assembly)
        return cls(
            np.maximum(lower - margin, [joint.lower + OFF_STOPS_RAD for joint in joints]),
            np.minimum(upper + margin, [joint.upper - OFF_STOPS_RAD for joint in joints]),
            np.full(assembly.n, V_MAX),
            np.full(assembly.n, A_MAX),
            TORQUE_SHARE * description.per_actuator("torque_max_Nm"),
            z_lower,
            z_upper,
        )

    def broken_by_motion(
        self,
        q: Float[np.ndarray, "sample joint"],
        v: Float[np.ndarray, "sample joint"],
        a: Float[np.ndarray, "sample joint"],
        slack: float = 1e-3,
    ) -> Bool[np.ndarray, " joint"]:
        """Joints (joint,) whose posture, speed or acceleration exceeds the limits by more than the share `slack`."""
        room = slack * (self.upper - self.lower)
        outside = (q < self.lower - room) | (q > self.upper + room)
        outside |= (np.abs(v) > (1 + slack) * self.v_max) | (np.abs(a) > (1 + slack) * self.a_max)
        return np.asarray(outside.any(axis=0))

    def broken_by_arm(
        self, z: Float[np.ndarray, "sample freedom"], tau: Float[np.ndarray, "sample joint"], slack: float = 0.02
    ) -> bool:
        """Return True if arm angles leave their range by more than `slack` [rad], or torque by more than this share."""
        is_strained = (z < self.z_lower - slack) | (z > self.z_upper + slack)
        return bool(is_strained.any() or (np.abs(tau) > (1 + slack) * self.tau_max).any())


def _comfort(assembly: Assembly) -> tuple[Freedoms, Freedoms]:
    names = [name for limb in assembly.arm.limbs for name in FREEDOMS[: limb.n_freedoms]]
    lower, upper = np.deg2rad([COMFORT_DEG[name] for name in names]).T
    # The filter does not use samples closer to the singular posture than this.
    usable = np.arccos(np.sqrt(NEAR_SINGULAR)) - np.deg2rad(1.0)
    abductions = [limb.freedoms.start + 1 for limb in assembly.arm.limbs]
    lower[abductions], upper[abductions] = np.maximum(lower[abductions], -usable), np.minimum(upper[abductions], usable)
    return lower, upper
