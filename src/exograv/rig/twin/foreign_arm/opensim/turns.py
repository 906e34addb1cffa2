"""Rotation matrices from the angles and axes of an OpenSim file."""

import numpy as np
from jaxtyping import Float


def turn(axis: Float[np.ndarray, " 3"], angle: float) -> Float[np.ndarray, "3 3"]:
    """Return the rotation about a unit vector by an angle [rad], by Rodrigues' formula."""
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * (K @ K)


def small_turn(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 3"]:
    """Return axis times sine of the angle of a rotation [-], which for a small one is its rotation vector [rad]."""
    return 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
