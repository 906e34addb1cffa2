"""The arm at rest in its cuffs with the machine's joints locked: where it settles, and what the locks then carry."""

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.errors import RigError

from .forces import static_forces
from .scene import Scene
from .wearer import Wearer

TOLERANCE = 1e-9
"""Largest torque left on the arm's joints [N·m]."""

MAX_STEPS = 50
DIFFERENCE = 1e-6
"""For the slopes of Newton's method [rad]; they set its pace, not its result."""

STEP_MAX = 0.1
"""Largest turn of a joint in one step [rad]; a longer one may leave the basin of the rest posture."""

CURVATURE_MIN = 1.0
"""Least stiffness that a step relies on; the cuffs hold the arm with ten times as much and more [N·m/rad]."""

Arm = Float[np.ndarray, " arm"]
Joints = Float[np.ndarray, " joint"]


class Statics:
    """Static torques of a scene by MuJoCo's own kinematics; friction and muscles are silent.

    The scene's state is overwritten.
    """

    def __init__(self, scene: Scene, wearer: Wearer | None, with_passive: bool) -> None:
        self._scene = scene
        self._forces = static_forces(scene, wearer, with_passive) if wearer is not None else None

    def settle(self, q: Joints, guess: Arm | None = None) -> tuple[Arm, Joints]:
        """Posture of the arm (arm,) [rad] and torque on the locks (joint,) [N·m] with the machine's joints at `q`.

        The torque is what motors must add to hold the machine there. `guess` starts the search; `q` itself where
        absent.

        Raises:
            RigError: The arm finds no rest, which means that the cuffs do not hold it.
        """
        if self._forces is None:
            return np.empty(0), -self._net_torque(q, np.empty(0))[self._scene.exo]
        q_arm = np.array(q if guess is None else guess, dtype=float)
        worst = np.inf
        for _ in range(MAX_STEPS):
            residual = self._residual(q, q_arm)
            worst = float(np.abs(residual).max())
            if worst <= TOLERANCE:
                # The residual was the last thing evaluated: forces and posture in the scene belong together.
                return q_arm, -self._scene.data.qfrc_smooth[self._scene.exo]
            q_arm = q_arm + _downhill(self._slopes(q, q_arm, residual), residual)
        raise RigError(
            f"The arm finds no rest with the machine at {np.rad2deg(q).round(1).tolist()}°: {worst:.1e} N·m remain "
            f"after {MAX_STEPS} steps. Choose a posture inside the task workspace, or stiffer cuffs."
        )

    def _residual(self, q: Joints, q_arm: Arm) -> Arm:
        net = self._net_torque(q, q_arm)
        if self._forces is None:
            return np.empty(0)
        # The shoulder centre is led along its path: what acts on the path acts on the joints through its slope.
        return net[self._scene.arm] + self._forces.outputs["slope"] * net[self._scene.shift]

    def _slopes(self, q: Joints, q_arm: Arm, residual: Arm) -> Float[np.ndarray, "arm arm"]:
        turned = q_arm + DIFFERENCE * np.eye(len(q_arm))
        return np.array([self._residual(q, one) - residual for one in turned]).T / DIFFERENCE

    def _net_torque(self, q: Joints, q_arm: Arm) -> Float[np.ndarray, " dof"]:
        """All generalised forces at rest [N·m, N].

        MuJoCo sums them on the way to accelerations that nobody needs here.
        """
        scene, model, data = self._scene, self._scene.model, self._scene.data
        data.qvel[:] = 0.0
        data.qpos[scene.exo] = q
        if self._forces is not None:
            data.qpos[scene.arm] = q_arm
            self._forces.evaluate()  # for the path's shift; its forces belong to the posture before
            data.qpos[scene.shift] = self._forces.outputs["shift"][0]
        mujoco.mj_step1(model, data)
        if self._forces is not None:
            self._forces.evaluate()
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        return data.qfrc_smooth


def _downhill(slopes: Float[np.ndarray, "arm arm"], torque: Arm) -> Arm:
    """Newton's step towards the least energy [rad].

    Bare Newton also stops on saddles, where the arm lies twisted in its cuffs: it did at one posture in fifty. Counting
    every curvature as positive leaves minima alone as its goals.
    """
    curvatures, axes = np.linalg.eigh(-0.5 * (slopes + slopes.T))
    step = axes @ ((axes.T @ torque) / np.maximum(np.abs(curvatures), CURVATURE_MIN))
    return step * min(1.0, STEP_MAX / np.abs(step).max())
