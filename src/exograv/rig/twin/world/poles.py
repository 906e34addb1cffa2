"""Damping of the wearer's shoulder near the pole of its angles, where the explicit joint forces are unstable.

At 90° of abduction the axes of flexion and rotation coincide. The inertia of the motion in which both angles turn
against each other falls with the square of the cosine of abduction. An explicit damping d is stable only while
d · step / inertia stays below 2, and for the twin's passive joints that ends at about 88°. MuJoCo's own damping of a
joint is implicit and stable at any inertia, so it is added there, and only there.
"""

import math
from dataclasses import dataclass

import mujoco

from exograv.rig.twin.wearer.wearer import Wearer

from .scene import Scene

POLE_COSINE = math.cos(math.radians(85.0))
"""Cosine of the abduction from which on the damping acts. Nearer to rest no number of a run changes."""

POLE_DAMPING = 1.0
"""Damping of flexion and rotation at the pole itself [N·m·s/rad]. It exceeds the explicit damping, at most 1 N·m·s/rad,
by which the forces would be unstable; half of it would be enough. Assumed."""


@dataclass
class ShoulderPole:
    """Pole of one shoulder's angles."""

    abduction: int
    """Place of abduction in `qpos` [-]."""

    others: list[int]
    """Degrees of freedom of flexion and rotation."""

    is_near: bool = False

    def damp(self, model: mujoco.MjModel, data: mujoco.MjData) -> None:
        """Set the damping of the next step."""
        cosine = abs(math.cos(data.qpos[self.abduction]))
        if cosine < POLE_COSINE:
            model.dof_damping[self.others] = POLE_DAMPING * (1.0 - cosine / POLE_COSINE)
            self.is_near = True
        elif self.is_near:
            model.dof_damping[self.others] = 0.0
            self.is_near = False


def shoulder_poles(scene: Scene, wearer: Wearer | None) -> tuple[ShoulderPole, ...]:
    """Poles of all shoulders with the usual three angles; other models of an arm have axes of their own."""
    if wearer is None:
        return ()
    poles = []
    for arm, place in zip(wearer.arms, scene.arms, strict=True):
        if arm.skeleton.is_usual:
            flexion, abduction, rotation, *_ = place.freedoms.tolist()
            poles.append(ShoulderPole(abduction, [flexion, rotation]))
    return tuple(poles)
