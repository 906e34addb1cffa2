"""The wearer's truth in the words of an estimator: inertial parameters of two bodies, joint offsets and elasticity."""

import numpy as np
from jaxtyping import Float

from .segments import Segment
from .wearer import ARM_JOINTS, Wearer

AXES = ("x", "y", "z")
INERTIA_ENTRIES = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}


def parameter_truth(wearer: Wearer) -> dict[str, float]:
    """True parameters by name, SI; only examiners and tests may read them.

    For `upper_arm` and `forearm` (forearm and hand as one body): `.mass` [kg], `.mcx` … first moments [kg·m] and `.ixx` … inertia
    [kg·m²], both about and at the proximal joint centre, x forward, y left, z up while the arm hangs straight. Products of inertia
    are entries of the inertia matrix, hence negative sums. Further `shoulder_offset.x` … [m] in base axes, `glenohumeral_share` [-],
    and for each joint `passive_stiffness.<joint>` [N·m/rad] and `passive_neutral.<joint>` [rad].
    """
    upper_arm, forearm, hand = (wearer.segments[name] for name in ("upper_arm", "forearm", "hand"))
    wrist = np.array([0.0, 0.0, -forearm.length])
    truth = _inertial("upper_arm", _about(upper_arm, np.zeros(3)))
    truth |= _inertial("forearm", _about(forearm, np.zeros(3)), _about(hand, wrist))
    truth |= {f"shoulder_offset.{axis}": float(x) for axis, x in zip(AXES, wearer.donning_offset, strict=True)}
    truth["glenohumeral_share"] = wearer.glenohumeral_share
    for joint, stiffness, neutral in zip(ARM_JOINTS, wearer.passive.stiffness, wearer.passive.neutral, strict=True):
        truth[f"passive_stiffness.{joint}"] = float(stiffness)
        truth[f"passive_neutral.{joint}"] = float(neutral)
    return truth


def _about(segment: Segment, origin: Float[np.ndarray, " 3"]) -> Float[np.ndarray, "4 4"]:
    """Mass, first moments and inertia about the body's origin, which the segment's own frame is `origin` away from.

    Laid out as [[inertia, first moment], [first momentᵀ, mass]], so that the bodies of a compound add.
    """
    com = origin + segment.com
    moment = segment.mass * com
    inertia = segment.inertia + segment.mass * (com @ com * np.eye(3) - np.outer(com, com))
    return np.block([[inertia, moment[:, None]], [moment[None, :], np.array([[segment.mass]])]])


def _inertial(body: str, *parts: Float[np.ndarray, "4 4"]) -> dict[str, float]:
    whole = np.sum(parts, axis=0)
    named = {f"{body}.mass": whole[3, 3]}
    named |= {f"{body}.mc{axis}": whole[i, 3] for i, axis in enumerate(AXES)}
    named |= {f"{body}.{name}": whole[entry] for name, entry in INERTIA_ENTRIES.items()}
    return {name: float(value) for name, value in named.items()}
