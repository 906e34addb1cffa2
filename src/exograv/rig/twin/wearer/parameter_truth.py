"""The wearer's truth in the words of an estimator: two inertial bodies, elastic joints, and where the shoulder is."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from .passive import shoulder_shift
from .posture import fastened_parts
from .skeleton import Bone
from .wearer import Wearer, WearerArm

INERTIA_ENTRIES = {"Ixx": (0, 0), "Ixy": (0, 1), "Iyy": (1, 1), "Ixz": (0, 2), "Iyz": (1, 2), "Izz": (2, 2)}
AXES = ("x", "y", "z")


def parameter_truth(wearer: Wearer) -> dict[str, float]:
    """True parameters by name, SI; only examiners and tests may read them.

    Of `upper_arm` and `forearm` (forearm and hand as one body, the hand straight), or of `upper_arm`, `forearm` and
    `hand` where the wrist moves: `.mass` [kg], first moments `.mx` to `.mz` [kg·m] and inertia `.Ixx` to `.Izz`
    [kg·m²] about the proximal joint centre; x forward, y left, z up while the arm hangs straight. Products of inertia
    are entries of the inertia matrix, hence negative sums. Bones that form a segment are counted where they are in
    the fastened cuffs, and in the axes that a usual arm would have there (`posture.fastened_parts`).

    Of each freedom: `.stiffness` [N·m/rad], `.spring_offset` (stiffness times neutral angle) [N·m], `.damping`
    [N·m·s/rad]. Of the shoulder's centre against the machine's, in base axes: `shoulder_offset_x` to `_z` [m] and
    `glenohumeral_slope`, the shift per elevation over the first 90° [m/rad], where the shoulder does not move by
    itself; the true path is not quite straight. With two arms every name begins with `right_` or `left_`.
    """
    if len(wearer.arms) == 1:
        return _of_arm(wearer, wearer.arms[0])
    return {f"{arm.side}_{name}": value for arm in wearer.arms for name, value in _of_arm(wearer, arm).items()}


def _of_arm(wearer: Wearer, arm: WearerArm) -> dict[str, float]:
    skeleton, truth = arm.skeleton, {}
    for segment in skeleton.centres:
        parts = [_about_origin(bone) for bone in fastened_parts(skeleton, segment)]
        truth |= _inertial(segment, np.sum(parts, axis=0))
    passive = arm.passive
    per_joint = {
        "stiffness": passive.stiffness,
        "spring_offset": passive.stiffness * passive.neutral,
        "damping": passive.damping,
    }
    for kind, values in per_joint.items():
        truth |= {f"{freedom}.{kind}": float(value) for freedom, value in zip(skeleton.freedoms, values, strict=True)}
    truth |= {f"shoulder_offset_{axis}": float(x) for axis, x in zip(AXES, arm.donning_offset, strict=True)}
    if skeleton.follows_elevation:
        forward = ca.SX([np.pi / 2.0, *[0.0] * (len(skeleton.freedoms) - 1)])
        raised = shoulder_shift(skeleton, forward, wearer.glenohumeral_share)
        truth["glenohumeral_slope"] = float(ca.DM(ca.evalf(raised))) / (np.pi / 2.0)
    return truth


def _about_origin(bone: Bone) -> Float[np.ndarray, "4 4"]:
    """Mass, first moments and inertia of a part about the origin of its segment.

    Laid out as [[inertia, first moment], [first momentᵀ, mass]], so that the parts of a body add.
    """
    com = bone.origin + bone.com
    moment = bone.mass * com
    inertia = bone.inertia + bone.mass * (com @ com * np.eye(3) - np.outer(com, com))
    return np.block([[inertia, moment[:, None]], [moment[None, :], np.array([[bone.mass]])]])


def _inertial(body: str, whole: Float[np.ndarray, "4 4"]) -> dict[str, float]:
    named = {"mass": whole[3, 3]}
    named |= {f"m{axis}": whole[i, 3] for i, axis in enumerate(AXES)}
    named |= {name: whole[entry] for name, entry in INERTIA_ENTRIES.items()}
    return {f"{body}.{name}": float(value) for name, value in named.items()}
