"""A kinematic tree in numbers: one body a joint, massless frames on the bodies, nothing symbolic."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError

Vector = Float[np.ndarray, " 3"]
Matrix = Float[np.ndarray, "3 3"]
InertialParameters = Float[np.ndarray, "body 10"]


@dataclass(frozen=True)
class Joint:
    """A joint and where it sits; the body of the same index moves with it, its frame in the joint's."""

    name: str
    kind: Literal["revolute", "prismatic"]
    parent: int
    """Index of the body that carries the joint; -1 is the base."""

    R_parent_joint: Matrix
    p_parent_joint: Vector
    """[m]"""

    axis: Vector
    """Unit vector in the joint's frame; positive motion and torque are along it."""

    lower: float
    """[rad] or [m]"""

    upper: float
    """[rad] or [m]"""

    effort: float
    """Largest torque or force [N·m] or [N]."""

    velocity: float
    """[rad/s] or [m/s]"""


@dataclass(frozen=True)
class Frame:
    """A massless frame on a body."""

    body: int
    """Index of the body; -1 is the base."""

    R_body_frame: Matrix
    p_body_frame: Vector
    """[m]"""


@dataclass(frozen=True)
class Tree:
    """Joints in an order in which a parent comes before its children."""

    name: str
    joints: tuple[Joint, ...]
    bodies: tuple[str, ...]
    phi: InertialParameters
    """[m, m·c (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz] of each body about its frame's origin [kg, kg·m, kg·m²]."""

    frames: Mapping[str, Frame]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names in order."""
        return tuple(joint.name for joint in self.joints)

    def index(self, name: str) -> int:
        """Position of a joint in the order.

        Raises:
            ModelError: No joint of that name.
        """
        if name not in self.joint_names:
            raise ModelError(f"No joint '{name}' in {self.name}. Joints there: {', '.join(self.joint_names)}.")
        return self.joint_names.index(name)

    def frame(self, name: str) -> Frame:
        """A frame by name.

        Raises:
            ModelError: No frame of that name.
        """
        if name not in self.frames:
            raise ModelError(f"No frame '{name}' in {self.name}. Frames there: {', '.join(sorted(self.frames))}.")
        return self.frames[name]

    def with_distance(self, joint: str, axis: Literal["x", "y", "z"], distance: float) -> "Tree":
        """The same tree with the origin of one joint at another distance [m] along an axis of its parent.

        It stays on the side where it is.

        Raises:
            ModelError: It is on no side: at zero along that axis.
        """
        i, k = self.index(joint), "xyz".index(axis)
        p = self.joints[i].p_parent_joint.copy()
        if p[k] == 0.0:
            raise ModelError(
                f"The origin of joint '{joint}' in {self.name} is at zero along {axis} of its parent; a length cannot "
                "be set there. Give the adjustment's axis in rig.toml."
            )
        p[k] = np.copysign(distance, p[k])
        joints = list(self.joints)
        joints[i] = replace(joints[i], p_parent_joint=p)
        return replace(self, joints=tuple(joints))


def inertial_parameters(mass: float, com: Vector, inertia_com: Matrix) -> Float[np.ndarray, " 10"]:
    """Parameters (10,) of a body about its origin, from mass [kg], centre [m] and inertia about the centre [kg·m²]."""
    inertia = inertia_com + mass * (com @ com * np.eye(3) - np.outer(com, com))
    moments = [inertia[0, 0], inertia[0, 1], inertia[1, 1], inertia[0, 2], inertia[1, 2], inertia[2, 2]]
    return np.array([mass, *(mass * com), *moments])


def inertia_about_origin(phi: Float[np.ndarray, " 10"]) -> Matrix:
    """Inertia (3, 3) about the body's origin [kg·m²]."""
    xx, xy, yy, xz, yz, zz = phi[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def pseudo_inertia(phi: Float[np.ndarray, " 10"]) -> Float[np.ndarray, "4 4"]:
    """Pseudo-inertia (4, 4); positive definite means physically possible.

    Source: Wensing, Kim, Slotine 2018, RA-L 3:60, eq. 9.
    """
    inertia = inertia_about_origin(phi)
    J = np.empty((4, 4))
    J[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    J[:3, 3] = J[3, :3] = phi[1:4]
    J[3, 3] = phi[0]
    return J


def from_pseudo_inertia(J: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, " 10"]:
    """The inertial parameters (10,) of a pseudo-inertia (4, 4)."""
    inertia = np.trace(J[:3, :3]) * np.eye(3) - J[:3, :3]
    moments = [inertia[0, 0], inertia[0, 1], inertia[1, 1], inertia[0, 2], inertia[1, 2], inertia[2, 2]]
    return np.array([J[3, 3], *J[:3, 3], *moments])


def is_physical(phi: Float[np.ndarray, " 10"]) -> bool:
    """Whether some distribution of positive mass has these parameters."""
    return bool(np.linalg.eigvalsh(pseudo_inertia(phi))[0] > 0.0)
