"""True inertial parameters of the machine's links, in the form that an estimator uses; for examiners only."""

from collections.abc import Mapping

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.model.tree import inertial_parameters
from exograv.rig.twin.machine.machine import Machine

from .scene import build_scene


def link_truth(
    description: RigDescription, machine: Machine, lengths: Mapping[str, float]
) -> Float[np.ndarray, "joint 10"]:
    """Inertial parameters of the body behind each joint, with all bodies that are fixed to it.

    Mass [kg], first moments [kg·m] and inertia about the origin [kg·m²], in the order of
    `model.tree.inertial_parameters`; the machine set to `lengths` by segment [m].
    """
    model = build_scene(description, machine, None, lengths).model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    owners = [int(model.joint(joint).bodyid[0]) for joint in description.joints]
    phi = np.zeros((len(owners), 10))
    for body in range(1, model.nbody):
        owner = body
        while owner and owner not in owners:
            owner = int(model.body_parentid[owner])
        if owner:
            phi[owners.index(owner)] += _parameters(model, data, body, owner)
    return phi


def _parameters(model: mujoco.MjModel, data: mujoco.MjData, body: int, owner: int) -> Float[np.ndarray, " 10"]:
    """Inertial parameters of one body, in the frame of the body to which it is fixed."""
    R_world_owner = data.xmat[owner].reshape(3, 3)
    R_owner_principal = R_world_owner.T @ data.ximat[body].reshape(3, 3)
    com = R_world_owner.T @ (data.xipos[body] - data.xpos[owner])
    inertia = R_owner_principal @ np.diag(model.body_inertia[body]) @ R_owner_principal.T
    return inertial_parameters(float(model.body_mass[body]), com, inertia)
