"""URDF text of a tree, which the opponents read, so that all compute the same machine."""

import numpy as np
from jaxtyping import Float

from exograv.model.tree import Tree, inertia_about_origin, inertial_parameters


def urdf_text(tree: Tree) -> str:
    """Return joints and masses as URDF; frames are left out, and joint limits are wide open."""
    links = [f"link_of_{joint.name}" for joint in tree.joints]
    # The base does not move; frax reads no base without mass.
    base = inertial_parameters(1.0, np.zeros(3), np.eye(3))
    lines = ['<robot name="machine">', f'<link name="base">{_inertial(base)}</link>']
    for joint, link, phi in zip(tree.joints, links, tree.phi, strict=True):
        parent = links[joint.parent] if joint.parent >= 0 else "base"
        origin = f'<origin xyz="{_words(joint.p_parent_joint)}" rpy="{_words(_roll_pitch_yaw(joint.R_parent_joint))}"/>'
        lines += [
            f'<link name="{link}">{_inertial(phi)}</link>',
            f'<joint name="{joint.name}" type="{joint.kind}"><parent link="{parent}"/><child link="{link}"/>{origin}',
            f'<axis xyz="{_words(joint.axis)}"/><limit lower="-9" upper="9" effort="999" velocity="99"/></joint>',
        ]
    return "\n".join([*lines, "</robot>"])


def _inertial(phi: Float[np.ndarray, " 10"]) -> str:
    mass, com = float(phi[0]), phi[1:4] / phi[0]
    inertia = inertia_about_origin(phi) - mass * (com @ com * np.eye(3) - np.outer(com, com))
    entries = {"ixx": (0, 0), "iyy": (1, 1), "izz": (2, 2), "ixy": (0, 1), "ixz": (0, 2), "iyz": (1, 2)}
    moments = " ".join(f'{name}="{float(inertia[entry])!r}"' for name, entry in entries.items())
    return f'<inertial><origin xyz="{_words(com)}" rpy="0 0 0"/><mass value="{mass!r}"/><inertia {moments}/></inertial>'


def _roll_pitch_yaw(R: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, " 3"]:
    """Return the angles about fixed x, y, z [rad]; not valid near a pitch of 90°."""
    pitch = np.arctan2(-R[2, 0], np.hypot(R[0, 0], R[1, 0]))
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])


def _words(values: Float[np.ndarray, " 3"]) -> str:
    return " ".join(repr(float(value)) for value in values)
