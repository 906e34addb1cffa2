"""Pole of the wearer's shoulder angles, near which the explicit damping of the passive joints is unstable.

At 90° of abduction the axes of flexion and rotation coincide, and the inertia m of the motion in which both angles turn
against each other vanishes. Explicit damping d is stable only while d · step / m stays below 2. Before that limit, the
same damping is handed to MuJoCo, which integrates the damping of joints implicitly and is stable at any inertia.
"""

import math
from collections.abc import Sequence

import mujoco
import numpy as np

from exograv.rig.native_period import NativePole
from exograv.rig.twin.wearer.wearer import Wearer

from .scene import TIMESTEP, Scene

STABLE_SHARE = 0.5
"""Value of d · step / m above which damping is integrated implicitly [-]: a quarter of the limit of stability. Smaller
values leave the run bitwise unchanged."""

FAR_COSINE = 0.5
"""Cosine of the abduction above which the inertia needs no look [-]."""


class ShoulderPole:
    """Pole of one shoulder's angles."""

    def __init__(self, scene: Scene, freedoms: Sequence[int], damping: Sequence[float]):
        """Begin away from the pole.

        Args:
            scene: World of the arm.
            freedoms: Degrees of freedom of flexion, abduction and rotation.
            damping: Passive damping of flexion and rotation [N·m·s/rad].
        """
        self._model, self._data = scene.model, scene.data
        self._flexion, self._abduction, self._rotation = freedoms
        self._turning = np.array([self._flexion, self._rotation])
        self._damping = np.array(damping)
        pairs = ((self._flexion, self._flexion), (self._rotation, self._rotation), (self._rotation, self._flexion))
        self._places = [_place(self._model, row, column) for row, column in pairs]
        self._is_near = np.zeros(1, dtype=np.int64)

    def before_forces(self) -> None:
        """Choose who damps the next step: MuJoCo near the pole, the joint forces elsewhere."""
        was_near, is_near = bool(self._is_near[0]), self._is_unstable()
        self._is_near[0] = is_near
        if is_near != was_near:
            self._model.dof_damping[self._turning] = self._damping if is_near else 0.0

    def after_forces(self) -> None:
        """Take the explicit damping out of the joint forces, where MuJoCo damps."""
        if self._is_near[0]:
            self._data.qfrc_applied[self._turning] += self._damping * self._data.qvel[self._turning]

    @property
    def native(self) -> NativePole:
        """Memory of the pole for a caller in C, which acts as `before_forces` and `after_forces` do."""
        data, turning = self._data, self._turning.tolist()
        return NativePole(
            data.qpos[self._abduction :],
            data.M,
            self._places,
            turning,
            self._damping,
            self._model.dof_damping,
            data.qvel,
            data.qfrc_applied,
            self._is_near,
            float(self._damping.max()) * TIMESTEP,
            STABLE_SHARE,
            FAR_COSINE,
        )

    def _is_unstable(self) -> bool:
        if abs(math.cos(self._data.qpos[self._abduction])) > FAR_COSINE:
            return False
        flexion, rotation, both = self._data.M[self._places].tolist()
        total = flexion + rotation
        # The smaller eigenvalue of the two angles' inertia, where it is far below the larger one.
        inertia = (flexion * rotation - both * both) / total if total else math.inf
        return float(self._damping.max()) * TIMESTEP > STABLE_SHARE * inertia


def _place(model: mujoco.MjModel, row: int, column: int) -> int:
    """Place of an entry of the inertia in `MjData.M`, the lower triangle row by row."""
    begin = int(model.M_rowadr[row])
    columns = model.M_colind[begin : begin + int(model.M_rownnz[row])].tolist()
    return begin + columns.index(column)


def shoulder_poles(scene: Scene, wearer: Wearer | None) -> tuple[ShoulderPole, ...]:
    """Poles of all shoulders with the usual three angles; other models of an arm have axes of their own."""
    if wearer is None:
        return ()
    poles = []
    for arm, place in zip(wearer.arms, scene.arms, strict=True):
        if arm.skeleton.is_usual:
            damping = arm.passive.damping.tolist()
            poles.append(ShoulderPole(scene, place.freedoms[:3].tolist(), (damping[0], damping[2])))
    return tuple(poles)
