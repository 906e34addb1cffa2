"""The arm beside the exoskeleton: four joints and two bodies, scaled to the person, with the prior's spread."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .anthropometry import Body, segment_lengths, segment_prior
from .description import Side
from .tree import Frame, Joint, Tree, inertial_parameters

SEGMENTS = ("upper_arm", "forearm")
ARM_JOINTS = (
    "glenohumeral_shift",
    "arm_flexion",
    "arm_abduction",
    "arm_rotation",
    "arm_lengthening",
    "arm_elbow",
)
SEGMENT_BODY = {"upper_arm": 3, "forearm": 5}
"""Index of the body in the tree that is this segment; the others are massless."""

GRIP_SHARE_OF_HAND = 0.36  # grip centre from the wrist, as the hand's centre of mass in de Leva's table


@dataclass(frozen=True)
class Arm:
    """An arm's tree with the table's inertial parameters and how far they can be off."""

    tree: Tree
    """Root at the shoulder centre, x forward, y left, z up. Two prismatic joints without mass: one shifts the shoulder
    centre, one sets the upper arm longer than it was measured."""

    lengths: dict[str, float]
    """Upper arm, forearm, hand [m]."""

    phi: Float[np.ndarray, " 20"]
    """Upper arm, then forearm with hand: (10,) each, about the proximal joint centre."""

    phi_covariance: Float[np.ndarray, "20 20"]


def build_arm(body: Body, side: Side) -> Arm:
    """The arm of a person by the table: upper arm, and forearm with a straight hand as one body."""
    lengths = segment_lengths(body)
    phi_upper, covariance_upper = segment_prior(body, "upper_arm")
    phi_forearm, covariance_forearm = segment_prior(body, "forearm")
    phi_hand, covariance_hand = segment_prior(body, "hand")
    move = translation_of_parameters(-lengths["forearm"])
    phi = np.concatenate([phi_upper, phi_forearm + move @ phi_hand])
    covariance = np.zeros((20, 20))
    covariance[:10, :10] = covariance_upper
    covariance[10:, 10:] = covariance_forearm + move @ covariance_hand @ move.T
    return Arm(arm_tree(lengths, side, phi), lengths, phi, covariance)


def arm_tree(lengths: dict[str, float], side: Side, phi: Float[np.ndarray, " 20"]) -> Tree:
    """The tree with these lengths [m] and inertial parameters; angles mean the same on both sides.

    Positive: flexion forward, abduction outward, rotation inward, elbow flexion. Order after Rajagopal 2016.
    """
    outward = 1.0 if side == "right" else -1.0
    # Shift of the shoulder centre: up and medial in the frontal plane (docs/arm.md; the direction is unverified).
    axes = [
        (0.0, outward * np.sqrt(0.5), np.sqrt(0.5)),
        (0.0, -1.0, 0.0),
        (-outward, 0.0, 0.0),
        (0.0, 0.0, outward),
        (0.0, 0.0, -1.0),
        (0.0, -1.0, 0.0),
    ]
    origins = np.zeros((6, 3))
    origins[4, 2] = -lengths["upper_arm"]
    lower = (0.0, -1.0, -0.6, -1.6, -0.05, 0.0)
    upper = (0.1, 3.0, 2.4, 1.6, 0.05, 2.6)
    joints = tuple(
        Joint(
            name, "prismatic" if i in (0, 4) else "revolute", i - 1, np.eye(3), origins[i], np.array(axes[i]),
            lower[i], upper[i], np.inf, np.inf,
        )
        for i, name in enumerate(ARM_JOINTS)
    )  # fmt: skip
    bodies = np.zeros((6, 10))
    bodies[SEGMENT_BODY["upper_arm"]], bodies[SEGMENT_BODY["forearm"]] = phi[:10], phi[10:]
    frames = {
        "upper_arm": Frame(3, np.eye(3), np.zeros(3)),
        "forearm": Frame(5, np.eye(3), np.zeros(3)),
        "wrist": Frame(5, np.eye(3), np.array([0.0, 0.0, -lengths["forearm"]])),
        "hand": Frame(5, np.eye(3), grip(lengths)),
        "finger_tip": Frame(5, np.eye(3), np.array([0.0, 0.0, -lengths["forearm"] - lengths["hand"]])),
    }
    return Tree(
        f"{side} arm", joints, ("shift", "flexion", "abduction", "upper_arm", "lengthening", "forearm"), bodies, frames
    )


def grip(lengths: dict[str, float]) -> Float[np.ndarray, " 3"]:
    """Where a held weight is, in the forearm's frame [m]."""
    return np.array([0.0, 0.0, -lengths["forearm"] - GRIP_SHARE_OF_HAND * lengths["hand"]])


def held_weight(lengths: dict[str, float], mass: float) -> Float[np.ndarray, " 20"]:
    """What a point mass [kg] in the hand adds to the arm's parameters."""
    return np.concatenate([np.zeros(10), inertial_parameters(mass, grip(lengths), np.zeros((3, 3)))])


def translation_of_parameters(z: float) -> Float[np.ndarray, "10 10"]:
    """Matrix (10, 10) that takes inertial parameters about the point (0, 0, z) [m] to those about the origin."""
    move = np.eye(10)
    move[3, 0] = z
    # I_origin = I_point + 2·z·m·c_z·1 − z·(e_z hᵀ + h e_zᵀ) + m·z²·(1 − e_z e_zᵀ), h = m·c about the point.
    xx, yy, xz, yz = 4, 6, 7, 8
    move[[xx, yy], 0] = z**2
    move[[xx, yy], 3] = 2.0 * z
    move[xz, 1] = -z
    move[yz, 2] = -z
    return move
