"""Test postures of an empty machine: three postures in which the weight torques of its links differ most."""

from itertools import combinations

import numpy as np
from jaxtyping import Float

from exograv.dynamics.at_rest import carrying_torque
from exograv.model.description import RigDescription
from exograv.model.tree import Tree

POSES = 3  # docs/explanation/safety.md, start-up self-test
INSIDE = np.deg2rad(14.0)  # of the joints' limits, as room for the passes


def telling_poses(description: RigDescription, tree: Tree) -> Float[np.ndarray, "3 joint"]:
    """Choose three postures [rad] from the corners and middles of the calibration's sweeps.

    They are the most informative ones for the joint with the smallest change of weight torque.
    """
    lower = np.array([joint.lower for joint in tree.joints]) + INSIDE
    upper = np.maximum(np.array([joint.upper for joint in tree.joints]) - INSIDE, lower)
    candidates = []
    for plan in description.calibration.sweeps:
        for angle in (plan.from_deg, 0.5 * (plan.from_deg + plan.to_deg), plan.to_deg):
            posture = np.deg2rad(plan.posture_deg)
            posture[description.joints.index(plan.joint)] = np.deg2rad(angle)
            candidates.append(np.clip(posture, lower, upper))
    loads = carrying_torque(tree, np.array(candidates))
    most = np.maximum(np.ptp(loads, axis=0), 1e-6)  # a joint with a vertical axis carries no weight in any posture

    def told(chosen: tuple[int, ...]) -> float:
        return float((np.ptp(loads[list(chosen)], axis=0) / most).min())

    return np.array([candidates[k] for k in max(combinations(range(len(candidates)), POSES), key=told)])
