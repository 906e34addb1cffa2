"""Surroundings of the machine: a screen for the fingertip, and a soft support on which the hand rests.

Both are MuJoCo contacts. They touch the wearer's fingertips and hands, and nothing else.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.rig.twin.wearer.arm_bodies import body_name
from exograv.rig.twin.wearer.skeleton import Skeleton

from .water import Water, flood

Vector = Float[np.ndarray, " 3"]

FINGER_RADIUS, HAND_RADIUS = 0.008, 0.03
"""Radii of the contact spheres at fingertip and palm [m]; assumed."""

FRICTION = {"screen": 0.5, "support": 0.8}
"""Friction of skin on glass, and of a sleeve on a lap [-]; assumed."""

SOLREF = {"screen": (0.01, 1.0), "support": (0.06, 1.0)}
"""Time constant [s] and damping ratio [-] of a contact: a finger's pad and a thigh, assumed."""

SCREEN, SUPPORT = "screen", "support"
MEETS = 4
"""MuJoCo's contact bit of the surroundings. The machine's own shapes have another one."""


@dataclass(frozen=True)
class Surroundings:
    """Places of screen and support in the machine's base frame: x forward, y left, z up."""

    screen_centre: Vector
    """Centre of the screen [m]."""

    screen_tilt: float
    """Angle by which the screen's upper edge leans away from the person [rad]."""

    support_z: float
    """Height of the support's upper side [m]."""

    water: Water | None = None
    """Water around the arm; air if absent."""

    @property
    def screen_axes(self) -> Float[np.ndarray, "3 3"]:
        """Axes of the screen as columns: right and up as the person sees it, and towards the person."""
        up = np.array([np.sin(self.screen_tilt), 0.0, np.cos(self.screen_tilt)])
        right = np.array([0.0, -1.0, 0.0])
        return np.column_stack([right, up, np.cross(right, up)])


def fingertip_of(skeleton: Skeleton) -> tuple[str, Vector]:
    """Bone that carries the fingertip, and its place in the bone's frame [m], on the line from wrist to grip."""
    (wrist_bone, wrist), (bone, grip) = skeleton.wrist, skeleton.grip
    # In an arm without a moving hand, the grip is on the forearm and the wrist is on a bone that hangs from the
    # forearm.
    start = skeleton.bone(wrist_bone).origin + wrist if wrist_bone != bone else wrist
    way = grip - start
    return bone, start + way / np.linalg.norm(way) * skeleton.lengths["hand"]


def add_surroundings(spec: mujoco.MjSpec, surroundings: Surroundings, skeletons: Sequence[Skeleton]) -> None:
    """Put screen, support and contact spheres into a world that has the wearer's arms."""
    R, world = surroundings.screen_axes, spec.worldbody
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, R.ravel())
    places = {
        SCREEN: (surroundings.screen_centre, quaternion),
        SUPPORT: (np.array([0.0, 0.0, surroundings.support_z]), np.array([1.0, 0.0, 0.0, 0.0])),
    }
    for name, (pos, quat) in places.items():
        world.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[0.0, 0.0, 1.0],  # an infinite plane: the part outside the panel is its frame
            pos=pos,
            quat=quat,
            contype=0,
            conaffinity=MEETS,
            friction=[FRICTION[name], 0.005, 0.0001],
            solref=SOLREF[name],
            priority=1,
        )
    for skeleton in skeletons:
        bone, tip = fingertip_of(skeleton)
        balls = {"finger": (tip, FINGER_RADIUS), "palm": (skeleton.grip[1], HAND_RADIUS)}
        for name, (place, radius) in balls.items():
            spec.body(body_name(skeleton, bone)).add_geom(
                name=f"{skeleton.side}_{name}",
                type=mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[radius, 0.0, 0.0],
                pos=place,
                contype=MEETS,
                conaffinity=0,
                mass=0.0,
            )
    if surroundings.water is not None:
        flood(spec, surroundings.water, skeletons)


class TouchedScreen:
    """Contacts of a finger with the screen."""

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, surroundings: Surroundings):
        """Find the screen in a compiled world that has one."""
        self._model, self._data, self._screen = model, data, model.geom(SCREEN).id
        self._centre, self._axes = surroundings.screen_centre, surroundings.screen_axes

    def put(self, is_there: bool) -> None:
        """Add screen and support, or remove them."""
        self._model.geom_conaffinity[[self._screen, self._model.geom(SUPPORT).id]] = MEETS if is_there else 0

    def finger(self) -> Float[np.ndarray, " 2"] | None:
        """Finger position on the screen, right and up of its centre as the person sees it [m]; None without contact."""
        for k in range(self._data.ncon):
            contact = self._data.contact[k]
            if self._screen in (contact.geom1, contact.geom2):
                return (self._axes.T @ (contact.pos - self._centre))[:2]
        return None
