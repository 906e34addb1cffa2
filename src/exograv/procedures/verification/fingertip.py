"""Displacement of an unseen fingertip by the left over, against the person's own stiffness."""

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv import kernel
from exograv.dynamics.parameters import ParameterLayout
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Parameters
from exograv.model.assembly import Assembly
from exograv.model.kinematics import frame_pose
from exograv.model.loops import arm_poses

from .postures import Postures

PERSON_NM_PER_RAD = {"shoulder": 20.0, "elbow": 14.0, "wrist": 2.0}
"""Stiffness with which a relaxed person holds the arm [N·m/rad]. An effective shoulder has 20-60 N·m/rad
(docs/howto/verify.md, unverified). The lower end is used, so that no displacement is underestimated. Elbow and wrist
are as in a virtual person (docs/explanation/transparency.md).
"""

STEP_RAD = 1e-4  # step of the finite difference

Displacements = Float[np.ndarray, "draw posture"]


class Fingertip:
    """Fingertip displacement at each posture, of the arm that moves farther."""

    def __init__(self, model: ArmModel, x: Parameters, postures: Postures):
        """Prepare the arm with parameters `x` in its machine, at `postures` [rad]."""
        assembly = model.assembly
        self._tips, self._model, self._x = kernel.compile(_tips_function(assembly)), model.again(), x
        self._fit = ParameterLayout.of(assembly).fit
        stiffness = np.array([PERSON_NM_PER_RAD[place] for place in assembly.description.places])
        self._per_torque = np.array([self._jacobian(q) for q in postures]) / stiffness

    def moved_mm(self, left_over: Float[np.ndarray, "draw posture joint"]) -> Displacements:
        """Displacement of the fingertip by torques [N·m] against the person's own stiffness [mm]."""
        moved = np.einsum("plij,dpj->dpli", self._per_torque, left_over)
        return 1e3 * np.linalg.norm(moved, axis=-1).max(axis=-1)

    def _jacobian(self, q: Float[np.ndarray, " joint"]) -> Float[np.ndarray, "limb 3 joint"]:
        here = self._at(q)
        steps = STEP_RAD * np.eye(len(q))
        return np.stack([(self._at(q + step) - here) / STEP_RAD for step in steps], axis=-1)

    def _at(self, q: Float[np.ndarray, " joint"]) -> Float[np.ndarray, "limb 3"]:
        self._model.at_rest(q, self._x)
        return self._tips.of(self._model.z, self._x[self._fit])[0].reshape(-1, 3)


def _tips_function(assembly: Assembly) -> ca.Function:
    layout, tree = ParameterLayout.of(assembly), assembly.arm.tree
    z, fit = ca.SX.sym("z", layout.freedoms), ca.SX.sym("fit", layout.fit.stop - layout.fit.start)
    poses = arm_poses(assembly, z, fit)
    tips = [frame_pose(tree, poses, limb.prefix + "finger_tip").p for limb in assembly.arm.limbs]
    return ca.Function("fingertips", [z, fit], [ca.vertcat(*tips)], ["z", "fit"], ["tips"])
