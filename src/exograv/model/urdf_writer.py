"""Writer of a tree as URDF, with limits and frames, so that other tools compute the same machine or arm."""

import numpy as np
from jaxtyping import Float

from .tree import Joint, Tree, inertia_about_origin

Matrix = Float[np.ndarray, "3 3"]
GIMBAL = 1e-9
"""Cosine of the pitch below which roll and yaw turn about the same axis [-]; roll then contains both."""
UNLIMITED = 1e3
"""Effort [N·m] and speed [rad/s] if the tree has no limit; URDF requires a number."""


def urdf_text(tree: Tree) -> str:
    """Write a tree as URDF.

    Bodies are named after their joints. A massless body is a link without inertial, and a frame is a fixed link.
    """
    links = [f"body_of_{joint.name}" for joint in tree.joints]
    lines = ['<?xml version="1.0"?>', f'<robot name="{tree.name}">', '  <link name="base"/>']
    for joint, link, phi in zip(tree.joints, links, tree.phi, strict=True):
        lines += [_link(link, phi), _joint(joint, links[joint.parent] if joint.parent >= 0 else "base", link)]
    for name, frame in tree.frames.items():
        if name != "base":
            parent = links[frame.body] if frame.body >= 0 else "base"
            lines += [f'  <link name="{name}"/>', _fixed(name, parent, frame.R_body_frame, frame.p_body_frame)]
    return "\n".join([*lines, "</robot>", ""])


def words(values: Float[np.ndarray, " entry"]) -> str:
    """Format numbers with all their digits."""
    return " ".join(repr(float(value)) for value in values)


def mass_centre_inertia(phi: Float[np.ndarray, " 10"]) -> tuple[float, Float[np.ndarray, " 3"], Matrix]:
    """Mass [kg], centre [m] and inertia about the centre [kg·m²] of a body with these parameters."""
    mass = float(phi[0])
    com = phi[1:4] / mass
    return mass, com, inertia_about_origin(phi) - mass * (com @ com * np.eye(3) - np.outer(com, com))


def roll_pitch_yaw(R: Matrix) -> Float[np.ndarray, " 3"]:
    """Roll, pitch and yaw about the fixed axes x, y, z [rad]."""
    across = np.hypot(R[0, 0], R[1, 0])
    pitch = np.arctan2(-R[2, 0], across)
    if across < GIMBAL:
        return np.array([np.arctan2(-R[1, 2], R[1, 1]), pitch, 0.0])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def _link(name: str, phi: Float[np.ndarray, " 10"]) -> str:
    if phi[0] == 0.0:
        return f'  <link name="{name}"/>'
    mass, com, inertia = mass_centre_inertia(phi)
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    moments = " ".join(f'{key}="{float(inertia[entry])!r}"' for key, entry in entries.items())
    return (
        f'  <link name="{name}">\n    <inertial>\n      <origin xyz="{words(com)}" rpy="0 0 0"/>\n'
        f'      <mass value="{mass!r}"/>\n      <inertia {moments}/>\n    </inertial>\n  </link>'
    )


def _joint(joint: Joint, parent: str, child: str) -> str:
    kind = joint.kind if np.isfinite([joint.lower, joint.upper]).all() else "continuous"
    ends = "" if kind == "continuous" else f'lower="{joint.lower!r}" upper="{joint.upper!r}" '
    effort, velocity = (min(limit, UNLIMITED) for limit in (joint.effort, joint.velocity))
    return (
        f'  <joint name="{joint.name}" type="{kind}">\n    <parent link="{parent}"/>\n'
        f'    <child link="{child}"/>\n'
        f'    {_origin(joint.R_parent_joint, joint.p_parent_joint)}\n    <axis xyz="{words(joint.axis)}"/>\n'
        f'    <limit {ends}effort="{effort!r}" velocity="{velocity!r}"/>\n'
        "  </joint>"
    )


def _fixed(name: str, parent: str, R: Matrix, p: Float[np.ndarray, " 3"]) -> str:
    return (
        f'  <joint name="to_{name}" type="fixed">\n    <parent link="{parent}"/>\n    <child link="{name}"/>\n'
        f"    {_origin(R, p)}\n  </joint>"
    )


def _origin(R: Matrix, p: Float[np.ndarray, " 3"]) -> str:
    return f'<origin xyz="{words(p)}" rpy="{words(roll_pitch_yaw(R))}"/>'
