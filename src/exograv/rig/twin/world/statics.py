"""Statics of the arm in its cuffs while the machine's joints are locked: posture at rest, and torque on the locks."""

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.errors import RigError
from exograv.rig.twin.wearer.wearer import Wearer

from .forces import static_forces
from .scene import Scene

TOLERANCE = 1e-9
"""Largest residual torque on the arm's joints at rest [N·m]."""

MAX_STEPS = 50
DIFFERENCE = 1e-6
"""Step of the finite differences in Newton's method [rad]. It changes the speed of convergence, not the result."""

TOLERANCE_ON_THE_WAY = 1e-2
"""Largest residual torque at intermediate postures [N·m]."""

STAGE = 0.15
"""Largest turn of a joint of the machine between two intermediate postures [rad]."""

STEP_MAX = 0.1
"""Largest turn of a joint in one Newton step [rad]; a longer step may leave the basin of the rest posture."""

CURVATURE_MIN = 1.0
"""Least stiffness that a Newton step relies on; the cuffs hold the arm with at least ten times as much [N·m/rad]."""

Arm = Float[np.ndarray, " arm"]
Joints = Float[np.ndarray, " joint"]


class Statics:
    """Static torques of a scene by MuJoCo's own kinematics, without friction and muscles.

    Each call overwrites the state of the scene.
    """

    def __init__(self, scene: Scene, wearer: Wearer | None, with_passive: bool) -> None:
        self._scene = scene
        self._forces = static_forces(scene, wearer, with_passive) if wearer is not None else None
        self._arm, self._followers = scene.arm, scene.followers
        self._last = scene.fastened
        self._is_held = wearer is None or bool(wearer.cuffs.stiffness.any())
        if self._forces is not None:
            self._led = self._forces.outputs["led"].reshape(-1)
            self._slope = self._forces.outputs["slope"].reshape(len(self._led), len(self._arm))

    def begin(self, q: Joints) -> tuple[Arm, Joints]:
        """Return posture and lock torque as `settle`. An arm with weight and without cuffs stays where it was donned.

        Its weight is then carried as by a person's hands.

        Raises:
            RigError: The arm finds no rest.
        """
        if self._is_held or not self._scene.model.opt.gravity.any():
            return self.settle(q)
        q_arm = self._scene.fastened[1]
        return q_arm, -self._net_torque(q, q_arm)[self._scene.exo]

    def settle(self, q: Joints, guess: Arm | None = None) -> tuple[Arm, Joints]:
        """Posture of the arm (arm,) [rad] and torque on the locks (joint,) [N·m] with the machine's joints at `q`.

        The torque is what the motors must add to hold the machine there. The search starts at `guess`. If absent, it
        starts at the machine's own angles if they are the arm's, else at the posture that the arm reaches on the
        machine's path.

        Raises:
            RigError: The arm finds no rest, which means that the cuffs do not hold it.
        """
        if self._forces is None:
            return np.empty(0), -self._net_torque(q, np.empty(0))[self._scene.exo]
        if guess is None:
            guess = q if self._scene.moves_alike else self._on_the_way(q)
        settled = self._descend(q, guess, TOLERANCE)
        self._last = q.copy(), settled[0]
        return settled

    def _on_the_way(self, q: Joints) -> Arm:
        """Approximate posture of the arm after the machine has moved from its fastened posture to `q`.

        The path starts at the last posture that was requested, if this one is nearer.
        """
        starts = sorted((self._last, self._scene.fastened), key=lambda start: float(np.abs(q - start[0]).max()))
        q_start, q_arm = starts[0]
        n_stages = int(np.ceil(np.abs(q - q_start).max() / STAGE))
        for stage in range(n_stages):
            q_arm, _ = self._descend(q_start + stage / n_stages * (q - q_start), q_arm, TOLERANCE_ON_THE_WAY)
        return q_arm

    def _descend(self, q: Joints, guess: Arm, tolerance: float) -> tuple[Arm, Joints]:
        q_arm = np.array(guess, dtype=float)
        worst = np.inf
        for _ in range(MAX_STEPS):
            residual = self._residual(q, q_arm)
            worst = float(np.abs(residual).max())
            if worst <= tolerance:
                # The residual was evaluated last, so forces and posture in the scene belong together.
                return q_arm, -self._scene.data.qfrc_smooth[self._scene.exo]
            q_arm = q_arm + _downhill(self._slopes(q, q_arm, residual), residual)
        raise RigError(
            f"The arm finds no rest with the machine at {np.rad2deg(q).round(1).tolist()}°: a residual torque of "
            f"{worst:.1e} N·m remains after {MAX_STEPS} steps. Choose a posture inside the task workspace, or "
            "stiffer cuffs."
        )

    def _residual(self, q: Joints, q_arm: Arm) -> Arm:
        net = self._net_torque(q, q_arm)
        if self._forces is None:
            return np.empty(0)
        # Shoulder centres follow their paths: a force on a path acts on the joints through the slope of the path.
        return net[self._arm] + self._slope.T @ net[self._followers]

    def _slopes(self, q: Joints, q_arm: Arm, residual: Arm) -> Float[np.ndarray, "arm arm"]:
        turned = q_arm + DIFFERENCE * np.eye(len(q_arm))
        return np.array([self._residual(q, one) - residual for one in turned]).T / DIFFERENCE

    def _net_torque(self, q: Joints, q_arm: Arm) -> Float[np.ndarray, " dof"]:
        """All generalised forces at rest [N·m, N].

        MuJoCo computes their sum before it computes accelerations, which are not used here.
        """
        scene, model, data = self._scene, self._scene.model, self._scene.data
        data.qvel[:] = 0.0
        data.qpos[scene.exo] = q
        if self._forces is not None:
            data.qpos[self._arm] = q_arm
            self._forces.evaluate()  # for the followers; its forces belong to the previous posture
            data.qpos[self._followers] = self._led
        mujoco.mj_step1(model, data)
        if self._forces is not None:
            self._forces.evaluate()
        mujoco.mj_fwdActuation(model, data)
        mujoco.mj_fwdAcceleration(model, data)
        return data.qfrc_smooth


def _downhill(slopes: Float[np.ndarray, "arm arm"], torque: Arm) -> Arm:
    """Newton step towards the least energy [rad].

    A plain Newton step also converges to saddles, where the arm lies twisted in its cuffs: this happened at one
    posture in fifty. With the absolute values of all curvatures it converges to minima only.
    """
    curvatures, axes = np.linalg.eigh(-0.5 * (slopes + slopes.T))
    step = axes @ ((axes.T @ torque) / np.maximum(np.abs(curvatures), CURVATURE_MIN))
    return step * min(1.0, STEP_MAX / np.abs(step).max())
