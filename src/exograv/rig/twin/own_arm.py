"""What a person knows about the own arm: the torque that a movement of it needs, at a gravity that is felt or believed."""

import casadi as ca
import mujoco
import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.motion import Trajectory

from .machine import Machine
from .passive import elastic_torque, shoulder_shift
from .scene import build_scene
from .wearer import Wearer

PerFreedom = Float[np.ndarray, " arm"]


class OwnArm:
    """Inverse dynamics of the arm alone, by the twin's engine: nothing of the machine is in it."""

    def __init__(self, description: RigDescription, machine: Machine, wearer: Wearer):
        """The machine only gives the arm its place and the direction of gravity."""
        self._scene, self._wearer = build_scene(description, machine, wearer), wearer
        self._gravity = machine.gravity
        q = ca.SX.sym("q", len(self._scene.arm))
        shift = shoulder_shift(q, wearer.glenohumeral_share)
        self._by_posture = ca.Function(
            "own_arm", [q], [shift, ca.gradient(shift, q), elastic_torque(wearer.passive, q)]
        )

    def torque(self, q: PerFreedom, v: PerFreedom, a: PerFreedom, gravity_level: float = 1.0) -> PerFreedom:
        """Muscle torque [N·m] for position [rad], velocity [rad/s] and acceleration [rad/s²] of the arm's freedoms.

        The shoulder's own path is followed to first order, hysteresis is left out.
        """
        scene, model, data = self._scene, self._scene.model, self._scene.data
        shift, slope, elastic = (np.asarray(value).ravel() for value in self._by_posture(q))
        data.qvel[:] = data.qacc[:] = 0.0
        data.qpos[scene.arm], data.qvel[scene.arm], data.qacc[scene.arm] = q, v, a
        data.qpos[scene.shift], data.qvel[scene.shift], data.qacc[scene.shift] = shift[0], slope @ v, slope @ a
        model.opt.gravity = gravity_level * self._gravity
        mujoco.mj_inverse(model, data)
        needed = data.qfrc_inverse[scene.arm] + slope * data.qfrc_inverse[scene.shift]
        return needed - elastic + self._wearer.passive.damping * v

    def torques(self, movement: Trajectory, gravity_level: float = 1.0) -> Float[np.ndarray, "tick arm"]:
        """The same along a movement."""
        rows = zip(movement.q, movement.v, movement.a, strict=True)
        return np.array([self.torque(q, v, a, gravity_level) for q, v, a in rows])
