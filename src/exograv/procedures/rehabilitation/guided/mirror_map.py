"""Mirror map: pairs of joints that are mirror images, and their signs, from the machine's axes."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float, Int

from exograv.errors import ConfigError
from exograv.model.description import ArmSide, RigDescription
from exograv.model.kinematics import body_poses
from exograv.model.tree import Tree

Joints = Float[np.ndarray, " joint"]

ALIGNED = 0.99
"""Cosine between an axis and the mirror image of its partner, above which they are a pair."""

PREFIXES: dict[ArmSide, tuple[str, str]] = {"right": ("right_", "left_"), "left": ("left_", "right_")}
"""Prefixes of the leading and following arm's joints, by the leading side."""


@dataclass(frozen=True)
class MirrorMap:
    """Mirror map of a machine for both arms."""

    partner: Int[np.ndarray, " joint"]
    """Index of each joint's mirror image."""

    sign: Joints
    """Sign that relates a joint's angle to that of its partner [-]."""

    lead: Int[np.ndarray, " lead"]
    """Joints of the leading arm."""

    follow: Int[np.ndarray, " lead"]
    """Partners of the leading joints, in the same order."""

    @classmethod
    def of(cls, description: RigDescription, exo: Tree, lead: ArmSide) -> "MirrorMap":
        """Build the map by names, right_… and left_…, and by axes at zero.

        Raises:
            ConfigError: The machine does not have two arms, or they are not mirror images of each other.
        """
        names = list(description.joints)
        pairs = (PREFIXES["right"], PREFIXES["left"])
        partners = [other + name.removeprefix(own) for name in names for own, other in pairs if name.startswith(own)]
        if len(partners) != len(names) or not set(partners) <= set(names):
            raise ConfigError(
                f"{description.name} does not have two arms with pairs of joints named right_… and left_…. Choose "
                "recupera_like_dual."
            )
        partner = np.array([names.index(one) for one in partners])
        axes = _axes(exo)
        # A rotation axis is a pseudovector: under the mirror its components in the mirror's plane change sign.
        image = axes * np.array([-1.0, 1.0, -1.0])
        cosine = np.einsum("ij,ij->i", image, axes[partner])
        if np.abs(cosine).min() < ALIGNED:
            worst = names[int(np.argmin(np.abs(cosine)))]
            raise ConfigError(
                f"{worst} of {description.name} is not a mirror image of its partner: their axes are "
                f"{np.rad2deg(np.arccos(np.abs(cosine).min())):.0f}° apart. Such arms cannot mirror each other."
            )
        own = PREFIXES[lead][0]
        leading = np.array([k for k, name in enumerate(names) if name.startswith(own)])
        return cls(partner, np.sign(cosine), leading, partner[leading])

    def mirrored(self, q: Joints) -> Joints:
        """Mirrored angles of both arms [rad], or velocities."""
        return (self.sign * q)[self.partner]


def _axes(exo: Tree) -> Float[np.ndarray, "joint 3"]:
    """Axes in the base frame, with all joints at zero."""
    q = ca.SX.sym("q", len(exo.joints))
    poses = body_poses(exo, q)
    axes = [pose.R @ ca.DM(joint.axis) for pose, joint in zip(poses, exo.joints, strict=True)]
    found = ca.Function("axes", [q], [ca.horzcat(*axes)])(ca.DM.zeros(len(exo.joints)))
    return np.array(found).T
