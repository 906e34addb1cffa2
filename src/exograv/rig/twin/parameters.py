"""The wearer's truth in the words of an estimator: two inertial bodies, elastic joints, and where the shoulder is."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from .passive import shoulder_shift
from .segments import Segment
from .wearer import Wearer

FREEDOMS = ("flexion", "abduction", "rotation", "elbow")
INERTIA_ENTRIES = {"Ixx": (0, 0), "Ixy": (0, 1), "Iyy": (1, 1), "Ixz": (0, 2), "Iyz": (1, 2), "Izz": (2, 2)}
AXES = ("x", "y", "z")


def parameter_truth(wearer: Wearer) -> dict[str, float]:
    """True parameters by name, SI; only examiners and tests may read them.

    Of `upper_arm` and `forearm` (forearm and hand as one body, the hand straight): `.mass` [kg], first moments `.mx` to
    `.mz` [kg·m] and inertia `.Ixx` to `.Izz` [kg·m²] about the proximal joint centre; x forward, y left, z up while the
    arm hangs straight. Products of inertia are entries of the inertia matrix, hence negative sums.

    Of each freedom: `.stiffness` [N·m/rad], `.spring_offset` (stiffness times neutral angle) [N·m], `.damping`
    [N·m·s/rad]. Of the shoulder's centre against the machine's, in base axes: `shoulder_offset_x` to `_z` [m] and
    `glenohumeral_slope`, the shift per elevation over the first 90° [m/rad]; the true path is not quite straight.
    """
    upper_arm, forearm, hand = (wearer.segments[name] for name in ("upper_arm", "forearm", "hand"))
    wrist = np.array([0.0, 0.0, -forearm.length])
    truth = _inertial("upper_arm", _about_origin(upper_arm, np.zeros(3)))
    truth |= _inertial("forearm", _about_origin(forearm, np.zeros(3)) + _about_origin(hand, wrist))
    passive = wearer.passive
    per_joint = {
        "stiffness": passive.stiffness,
        "spring_offset": passive.stiffness * passive.neutral,
        "damping": passive.damping,
    }
    for kind, values in per_joint.items():
        truth |= {f"{freedom}.{kind}": float(value) for freedom, value in zip(FREEDOMS, values, strict=True)}
    truth |= {f"shoulder_offset_{axis}": float(x) for axis, x in zip(AXES, wearer.donning_offset, strict=True)}
    raised = shoulder_shift(ca.SX([np.pi / 2.0, 0.0, 0.0, 0.0]), wearer.glenohumeral_share)
    truth["glenohumeral_slope"] = float(ca.DM(ca.evalf(raised))) / (np.pi / 2.0)
    return truth


def _about_origin(segment: Segment, origin: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "4 4"]:
    """Mass, first moments and inertia about the body's origin, the segment's own frame being at `origin` in it.

    Laid out as [[inertia, first moment], [first momentᵀ, mass]], so that the parts of a body add.
    """
    com = origin + segment.com
    moment = segment.mass * com
    inertia = segment.inertia + segment.mass * (com @ com * np.eye(3) - np.outer(com, com))
    return np.block([[inertia, moment[:, None]], [moment[None, :], np.array([[segment.mass]])]])


def _inertial(body: str, whole: Float[np.ndarray, "4 4"]) -> dict[str, float]:
    named = {"mass": whole[3, 3]}
    named |= {f"m{axis}": whole[i, 3] for i, axis in enumerate(AXES)}
    named |= {name: whole[entry] for name, entry in INERTIA_ENTRIES.items()}
    return {f"{body}.{name}": float(value) for name, value in named.items()}
