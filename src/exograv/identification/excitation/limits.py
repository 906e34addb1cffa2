"""What a motion that identifies an arm may ask of a relaxed person and of the machine."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from exograv.model.arm import COMFORT_DEG
from exograv.model.assembly import Assembly
from exograv.model.limb import FREEDOMS
from exograv.model.loops import NEAR_SINGULAR

V_MAX, A_MAX = 1.2, 4.0  # rad/s, rad/s²: gentle for a relaxed arm
TORQUE_SHARE = 0.7  # of the rated torque: a person may be a quarter heavier than the table says
MARGIN_DEG = {"shoulder": 12.0, "elbow": 12.0, "wrist": 6.0}
"""Beyond the task workspace, to tell elasticity from weight, by where a joint is."""
OFF_STOPS_RAD = np.deg2rad(8.0)  # from the machine's own limits: the weak control lets a joint stray

Joints = Float[np.ndarray, " joint"]
Freedoms = Float[np.ndarray, " freedom"]


@dataclass(frozen=True)
class MotionLimits:
    """Of the machine's joints, and of the arm in it."""

    lower: Joints
    """[rad]"""

    upper: Joints
    """[rad]"""

    v_max: Joints
    """[rad/s]"""

    a_max: Joints
    """[rad/s²]"""

    tau_max: Joints
    """Torque that a nominal person may ask of the machine [N·m]."""

    z_lower: Freedoms
    """Of the arm's own angles: comfortable, and away from the singular posture [rad]."""

    z_upper: Freedoms
    """[rad]"""

    @classmethod
    def of(cls, assembly: Assembly) -> "MotionLimits":
        """Around the task workspace, inside the machine's limits and the person's comfort."""
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
        """Joints (joint,) whose posture, speed or acceleration leaves the limits by more than `slack` of them."""
        room = slack * (self.upper - self.lower)
        outside = (q < self.lower - room) | (q > self.upper + room)
        outside |= (np.abs(v) > (1 + slack) * self.v_max) | (np.abs(a) > (1 + slack) * self.a_max)
        return np.asarray(outside.any(axis=0))

    def broken_by_arm(
        self, z: Float[np.ndarray, "sample freedom"], tau: Float[np.ndarray, "sample joint"], slack: float = 0.02
    ) -> bool:
        """Whether the arm's angles leave their range by more than `slack` [rad], or the torque by that share."""
        is_strained = (z < self.z_lower - slack) | (z > self.z_upper + slack)
        return bool(is_strained.any() or (np.abs(tau) > (1 + slack) * self.tau_max).any())


def _comfort(assembly: Assembly) -> tuple[Freedoms, Freedoms]:
    names = [name for limb in assembly.arm.limbs for name in FREEDOMS[: limb.n_freedoms]]
    lower, upper = np.deg2rad([COMFORT_DEG[name] for name in names]).T
    # Samples nearer to the singular posture than this are not used by the filter.
    usable = np.arccos(np.sqrt(NEAR_SINGULAR)) - np.deg2rad(1.0)
    abductions = [limb.freedoms.start + 1 for limb in assembly.arm.limbs]
    lower[abductions], upper[abductions] = np.maximum(lower[abductions], -usable), np.minimum(upper[abductions], usable)
    return lower, upper
