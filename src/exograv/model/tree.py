"""Kinematic tree in numbers: one body per joint, and massless frames on the bodies."""

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
    """Joint and its pose; the body of the same index moves with the joint and has the joint's frame."""

    name: str
    kind: Literal["revolute", "prismatic"]
    parent: int
    """Index of the body that carries the joint; -1 is the base."""

    R_parent_joint: Matrix
    p_parent_joint: Vector
    """Origin of the joint in the parent's frame [m]."""

    axis: Vector
    """Unit vector in the joint's frame; positive motion and torque are along it."""

    lower: float
    """Smallest position [rad] or [m]."""

    upper: float
    """Largest position [rad] or [m]."""

    effort: float
    """Largest torque or force [N·m] or [N]."""

    velocity: float
    """Largest speed [rad/s] or [m/s]."""


@dataclass(frozen=True)
class Frame:
    """Massless frame on a body."""

    body: int
    """Index of the body; -1 is the base."""

    R_body_frame: Matrix
    p_body_frame: Vector
    """Origin of the frame in the body's frame [m]."""


@dataclass(frozen=True)
class Tree:
    """Kinematic tree; in the order of joints, parents come before their children."""

    name: str
    joints: tuple[Joint, ...]
    bodies: tuple[str, ...]
    phi: InertialParameters
    """Inertial parameters [m, m·c (3), Ixx, Ixy, Iyy, Ixz, Iyz, Izz] of each body about the origin of its frame
    [kg, kg·m, kg·m²]."""

    frames: Mapping[str, Frame]

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in order."""
        return tuple(joint.name for joint in self.joints)

    def index(self, name: str) -> int:
        """Index of a joint by name.

        Raises:
            ModelError: The tree has no joint with this name.
        """
        if name not in self.joint_names:
            raise ModelError(f"No joint '{name}' in {self.name}. Joints there: {', '.join(self.joint_names)}.")
        return self.joint_names.index(name)

    def frame(self, name: str) -> Frame:
        """Frame by name.

        Raises:
            ModelError: The tree has no frame with this name.
        """
        if name not in self.frames:
            raise ModelError(f"No frame '{name}' in {self.name}. Frames there: {', '.join(sorted(self.frames))}.")
        return self.frames[name]

    def with_distance(self, joint: str, axis: Literal["x", "y", "z"], distance: float) -> "Tree":
        """Return a copy with the origin of one joint at another distance [m] along an axis of its parent.

        The origin stays on its side of the parent's origin.

        Raises:
            ModelError: The origin is at zero along this axis, so that its side is not defined.
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
    """Inertia matrix (3, 3) about the body's origin [kg·m²]."""
    xx, xy, yy, xz, yz, zz = phi[4:]
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def pseudo_inertia(phi: Float[np.ndarray, " 10"]) -> Float[np.ndarray, "4 4"]:
    """Pseudo-inertia (4, 4) of a body; it is positive definite if the body is physically possible.

    Source: Wensing, Kim, Slotine 2018, RA-L 3:60, eq. 9.
    """
    inertia = inertia_about_origin(phi)
    J = np.empty((4, 4))
    J[:3, :3] = 0.5 * np.trace(inertia) * np.eye(3) - inertia
    J[:3, 3] = J[3, :3] = phi[1:4]
    J[3, 3] = phi[0]
    return J


def from_pseudo_inertia(J: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, " 10"]:
    """Inertial parameters (10,) of a pseudo-inertia (4, 4)."""
    inertia = np.trace(J[:3, :3]) * np.eye(3) - J[:3, :3]
    moments = [inertia[0, 0], inertia[0, 1], inertia[1, 1], inertia[0, 2], inertia[1, 2], inertia[2, 2]]
    return np.array([J[3, 3], *J[:3, 3], *moments])


def is_physical(phi: Float[np.ndarray, " 10"]) -> bool:
    """Return True if a distribution of positive mass with these parameters exists."""
    return bool(np.linalg.eigvalsh(pseudo_inertia(phi))[0] > 0.0)
