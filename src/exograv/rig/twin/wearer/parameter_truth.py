"""True parameters of the wearer, as an estimator names them: inertial bodies, elastic joints, shoulder offset."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from .elbow import outward_sign
from .passive import shoulder_shift
from .posture import fastened_parts, hanging_points, turned_to_lie
from .skeleton import Bone, Skeleton
from .wearer import Wearer, WearerArm

INERTIA_ENTRIES = {"Ixx": (0, 0), "Ixy": (0, 1), "Iyy": (1, 1), "Ixz": (0, 2), "Iyz": (1, 2), "Izz": (2, 2)}
AXES = ("x", "y", "z")


def parameter_truth(wearer: Wearer) -> dict[str, float]:
    """Return the true parameters by name, SI; only examiners and tests may read them.

    Inertial parameters belong to `upper_arm` and `forearm` (forearm and hand as one body, the hand straight), or to
    `upper_arm`, `forearm` and `hand` if the wrist moves. They are `.mass` [kg], first moments `.mx` to `.mz` [kg·m]
    and inertia `.Ixx` to `.Izz` [kg·m²] about the proximal joint centre; x forward, y left, z up while the arm hangs
    straight. Products of inertia are entries of the inertia matrix, hence negative sums. Bones of one segment are
    taken at their places in the fastened cuffs, in the axes that a usual arm would have there
    (`posture.fastened_parts`).

    Each freedom has `.stiffness` [N·m/rad], `.spring_offset` (stiffness times neutral angle) [N·m] and `.damping`
    [N·m·s/rad]. Neutral angles are counted as in a usual arm that lies alike in the fastened cuffs. The offset of the
    shoulder centre from the machine's is `shoulder_offset_x` to `_z` [m], in base axes. `glenohumeral_slope` is the
    mean shift per elevation over the first 90° [m/rad]; the true path is not quite straight. `glenohumeral_forward` and
    `glenohumeral_outward` are zero: the direction at home is the usual one. All three are absent if a girdle of bones
    moves the shoulder.

    `elbow_axis_x` and `elbow_axis_z` are components of
    the elbow's unit axis [-], in the axes of the upper arm as it lies in the fastened cuffs, when the bent forearm
    points along x: zero if the axis is at right angles to both bones. `carrying_angle` is the least angle between the
    bones' lines as the elbow turns, positive outwards [rad]. With two arms every name begins with `right_` or
    `left_`. Where a foreign world has another law, a parameter of the home law does not exist and is absent: stiffness
    and spring offset in the world of other tissue, the three glenohumeral entries in the world of another shoulder, and
    all of these in the unseen world.
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
    per_joint = {"damping": passive.damping}
    if passive.tissue is None:
        neutral = passive.neutral - turned_to_lie(skeleton)
        per_joint |= {"stiffness": passive.stiffness, "spring_offset": passive.stiffness * neutral}
    for kind, values in per_joint.items():
        truth |= {f"{freedom}.{kind}": float(value) for freedom, value in zip(skeleton.freedoms, values, strict=True)}
    truth |= _elbow(skeleton)
    truth |= {f"shoulder_offset_{axis}": float(x) for axis, x in zip(AXES, arm.donning_offset, strict=True)}
    if skeleton.follows_elevation and wearer.shoulder_path is None:
        forward = ca.SX([np.pi / 2.0, *[0.0] * (len(skeleton.freedoms) - 1)])
        raised = shoulder_shift(skeleton, forward, wearer.glenohumeral_share)
        truth["glenohumeral_slope"] = float(ca.DM(ca.evalf(raised))) / (np.pi / 2.0)
        truth |= {"glenohumeral_forward": 0.0, "glenohumeral_outward": 0.0}
    return truth


def _elbow(skeleton: Skeleton) -> dict[str, float]:
    """Obliqueness of the elbow's axis to the lines of the upper arm and of the forearm, and the carrying angle."""
    points = hanging_points(skeleton)
    upper_arm, forearm = points["elbow"] - points["shoulder"], points["wrist"] - points["elbow"]
    axis = next(joint.axis for bone in skeleton.bones for joint in bone.joints if joint.name == "elbow")
    along_upper_arm, along_forearm = (
        float(axis @ line / np.linalg.norm(axis) / np.linalg.norm(line)) for line in (upper_arm, forearm)
    )
    inwards = np.arcsin(along_upper_arm) - np.arcsin(along_forearm)
    return {
        "elbow_axis_x": along_forearm,
        "elbow_axis_z": -along_upper_arm,
        "carrying_angle": float(outward_sign(skeleton.side) * inwards),
    }


def _about_origin(bone: Bone) -> Float[np.ndarray, "4 4"]:
    """Mass, first moments and inertia of a part about the origin of its segment.

    The layout [[inertia, first moment], [first momentᵀ, mass]] lets the parts of a body be added.
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
