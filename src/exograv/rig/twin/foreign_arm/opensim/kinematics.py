"""Poses of an OpenSim model's bodies, with the coordinates that follow others."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError

from .document import GROUND, OsimDocument, OsimJoint, Pose
from .functions import Function, after
from .turns import small_turn, turn


@dataclass(frozen=True)
class Drive:
    """Coordinate that determines another one, and the function that does."""

    root: str
    """Coordinate that follows no other."""

    law: Function | None
    """Function of the root's value; None if the coordinate is its own root."""


class OsimKinematics:
    """Poses and coordinates of a model, by the values of the coordinates that follow no other."""

    def __init__(self, document: OsimDocument) -> None:
        self.document = document
        self.coordinates = {coordinate.name: coordinate for _, coordinate in document.coordinates()}

    def drive(self, coordinate: str) -> Drive:
        """Return what determines a coordinate.

        Raises:
            ModelError: A coupling cannot be used, or is a circle.
        """
        law: Function | None = None
        seen: list[str] = []
        while coordinate in self.document.couplings:
            coupling = self.document.couplings[coordinate]
            if coupling.problem:
                raise ModelError(coupling.problem)
            if coordinate in seen or coupling.leader not in self.coordinates:
                raise ModelError(
                    f"{self.document.path}: coordinate '{coordinate}' follows '{coupling.leader}', which does not "
                    "exist or follows it in turn. Correct the coupling."
                )
            seen.append(coordinate)
            law = coupling.law if law is None else after(law, coupling.law)
            coordinate = coupling.leader
        return Drive(coordinate, law)

    def value(self, coordinate: str, roots: Mapping[str, float] | None = None) -> float:
        """Value of a coordinate; the roots that are not given have their default [rad, m]."""
        drive = self.drive(coordinate)
        root = (roots or {}).get(drive.root, self.coordinates[drive.root].default)
        return root if drive.law is None else drive.law(root)

    def turned(self, joint: OsimJoint, roots: Mapping[str, float] | None = None) -> Pose:
        """Pose of the child's joint frame in the parent's.

        Raises:
            ModelError: The joint cannot be used.
        """
        if joint.problem:
            raise ModelError(joint.problem)
        T = np.eye(4)
        for axis in joint.axes:
            value = axis.function(self.value(axis.coordinate, roots) if axis.coordinate else 0.0)
            if axis.is_slide:
                T[:3, 3] += value * axis.direction
            else:
                T[:3, :3] = T[:3, :3] @ turn(axis.direction, value)
        return T

    def pose(self, body: str, roots: Mapping[str, float] | None = None) -> Pose:
        """Pose of a body on the ground."""
        if body == GROUND:
            return np.eye(4)
        T = np.eye(4)
        for child in self.document.path_to(body):
            T = T @ self.place(child, roots)
        return T

    def place(self, child: str, roots: Mapping[str, float] | None = None) -> Pose:
        """Pose of a body on its parent."""
        joint = self.document.joints[child]
        return joint.T_parent_F @ self.turned(joint, roots) @ np.linalg.inv(joint.T_child_M)

    def centre(self, child: str, roots: Mapping[str, float] | None = None) -> Float[np.ndarray, " 3"]:
        """Centre of the joint of a body on the ground [m]."""
        return (self.pose(child, roots) @ self.document.joints[child].T_child_M)[:3, 3]

    def axis(self, coordinate: str, roots: Mapping[str, float] | None = None) -> Float[np.ndarray, " 3"]:
        """Axis about which a coordinate turns its body [-], on the ground, by the right-hand rule."""
        child = next(body for body, one in self.document.coordinates() if one.name == coordinate)
        at, step = self.value(coordinate, roots), 1e-4  # rad
        R = [self.pose(child, {**(roots or {}), coordinate: at + s})[:3, :3] for s in (-step, step)]
        return small_turn(R[1] @ R[0].T) / np.sin(2.0 * step)
