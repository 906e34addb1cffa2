"""Person's arm in a machine in plain numbers: trees with identified parameters, and the frames of the cuffs."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.spatial import rotation_about

from .assembly import Assembly
from .kinematics import Hinges, body_poses, frame_pose
from .loops import (
    FIT,
    PATH_ENTRIES,
    PATH_SHAPES,
    SHIFT_ENTRIES,
    arm_hinges,
    arm_poses,
    arm_positions,
    arm_roots,
    cuff_pairs,
)
from .rig_settings import ArmSide
from .tree import Frame, Tree

Matrix = Float[np.ndarray, "3 3"]
Vector = Float[np.ndarray, " 3"]


@dataclass(frozen=True)
class CuffHold:
    """Cuff in numbers: two frames that coincide where it was fastened, and the stiffness between them."""

    name: str
    exo_frame: str
    arm_frame: str
    segment: str
    R_segment_cuff: Matrix
    p_segment_cuff: Vector
    """Position of the cuff in the segment's frame [m]."""
    stiffness: Float[np.ndarray, " 6"]
    """Stiffness along x, y, z [N/m], then about x, y, z [N·m/rad], in the machine's cuff frame."""


@dataclass(frozen=True)
class Personal:
    """Machine with the arm of one person."""

    exo: Tree
    arm: Tree
    """Tree of the arm with the learned length built in; the shoulder's centre moves along three joints."""
    bases: Mapping[ArmSide, Vector]
    """Position of each arm's base in the machine's base frame: the wearer's shoulder centre [m]."""
    offsets: Mapping[ArmSide, Vector]
    """Offset of each arm's base from the machine's shoulder centre [m]."""
    paths: Mapping[ArmSide, Mapping[str, Vector]]
    """Path of each arm's shoulder centre along its three joints: `slope` per elevation, mean over the first 90°
    [m/rad], then the displacement per shape of `model.loops.PATH_SHAPES` [m]."""
    cuffs: tuple[CuffHold, ...]


def personal(
    assembly: Assembly,
    phi_exo: Float[np.ndarray, "joint 10"],
    phi_arm: Float[np.ndarray, " phi"],
    fit: Float[np.ndarray, " fit"],
) -> Personal:
    """Build the numbers of an assembly with these inertial parameters and this fit (`model.loops.fit_names`)."""
    arm = assembly.arm
    masses = np.zeros((len(arm.tree.joints), 10))
    masses[list(arm.bodies)] = phi_arm.reshape(-1, 10)
    tree = replace(arm.tree, phi=masses)
    holds = _holds(assembly, fit)
    tree = replace(tree, frames={**tree.frames, **{hold.arm_frame: _frame(tree, hold) for hold in holds}})
    parts = fit.reshape(-1, len(FIT))
    tree = with_hinges(tree, arm_hinges(assembly, _constant(fit)))
    for limb in reversed(arm.limbs):
        tree = without_joint(tree, limb.lengthening, float(parts[limb.number, FIT.index("upper_arm_lengthening")]))
    roots: dict[ArmSide, Vector] = {
        limb.side: _vector(root.p) for limb, root in zip(arm.limbs, arm_roots(assembly, _constant(fit)), strict=True)
    }
    return Personal(
        replace(assembly.exo, phi=phi_exo),
        tree,
        roots,
        {limb.side: parts[limb.number, :3] for limb in arm.limbs},
        {limb.side: _path(parts[limb.number]) for limb in arm.limbs},
        holds,
    )


def _path(fit: Float[np.ndarray, " entry"]) -> dict[str, Vector]:
    shapes = zip(PATH_SHAPES, fit[PATH_ENTRIES].reshape(-1, 3), strict=True)
    return {"slope": fit[list(SHIFT_ENTRIES)], **dict(shapes)}


def with_hinges(tree: Tree, hinges: Hinges) -> Tree:
    """Return a copy of the tree with these oblique hinges, in numbers, as its own joints."""
    joints = list(tree.joints)
    for i, hinge in hinges.items():
        axis = _vector(hinge.axis)
        back = np.array(ca.evalf(rotation_about(hinge.axis, ca.SX(-hinge.zero))))
        joints[i] = replace(joints[i], R_parent_joint=hinge.R_parent_zero @ back, axis=axis)
    return replace(tree, joints=tuple(joints))


def joint_positions(
    assembly: Assembly, z: Float[np.ndarray, " freedom"], fit: Float[np.ndarray, " fit"]
) -> Float[np.ndarray, " arm_joint"]:
    """Positions [rad or m] of the joints of the arm's tree `with_hinges` at the arm's freedoms z [rad]."""
    return np.array(ca.evalf(arm_positions(assembly.arm, _constant(z), _constant(fit)))).ravel()


def without_joint(tree: Tree, index: int, position: float) -> Tree:
    """Return a copy of the tree in which one prismatic joint, of a massless body, is fixed at a position [m]."""
    gone = tree.joints[index]
    R, p = gone.R_parent_joint, gone.p_parent_joint + gone.R_parent_joint @ gone.axis * position

    def moved(body: int) -> int:
        return gone.parent if body == index else body - (body > index)

    joints = tuple(
        replace(
            joint,
            parent=moved(joint.parent),
            R_parent_joint=R @ joint.R_parent_joint if joint.parent == index else joint.R_parent_joint,
            p_parent_joint=p + R @ joint.p_parent_joint if joint.parent == index else joint.p_parent_joint,
        )
        for i, joint in enumerate(tree.joints)
        if i != index
    )
    frames = {
        name: Frame(
            moved(frame.body),
            R @ frame.R_body_frame if frame.body == index else frame.R_body_frame,
            p + R @ frame.p_body_frame if frame.body == index else frame.p_body_frame,
        )
        for name, frame in tree.frames.items()
    }
    bodies = tree.bodies[:index] + tree.bodies[index + 1 :]
    return Tree(tree.name, joints, bodies, np.delete(tree.phi, index, axis=0), frames)


def _holds(assembly: Assembly, fit: Float[np.ndarray, " fit"]) -> tuple[CuffHold, ...]:
    """Poses of the cuffs on their segments, as fastened in the donning posture."""
    description, tree = assembly.description, assembly.arm.tree
    y, z = _constant(description.donning_posture), _constant(description.arm_donning_posture)
    exo = body_poses(assembly.exo, y)
    arm = arm_poses(assembly, z, _constant(fit))
    holds = []
    for cuff, pair in zip(assembly.cuffs, cuff_pairs(assembly, exo, arm, _constant(fit)), strict=True):
        limb = assembly.arm.limb(cuff.side)
        segment = limb.prefix + cuff.segment
        place = frame_pose(tree, arm, segment).inverse() @ pair.T_world_arm
        translation, rotation = np.exp(fit.reshape(-1, len(FIT))[limb.number, 5:7])
        stiffness = cuff.stiffness * np.array([translation] * 3 + [rotation] * 3)
        name = limb.prefix + cuff.name if not cuff.name.startswith(limb.prefix) else cuff.name
        R = np.array(ca.evalf(place.R))
        holds.append(CuffHold(name, cuff.exo_frame, f"{name}_hold", segment, R, _vector(place.p), stiffness))
    return tuple(holds)


def _frame(tree: Tree, hold: CuffHold) -> Frame:
    segment = tree.frame(hold.segment)
    R = segment.R_body_frame
    return Frame(segment.body, R @ hold.R_segment_cuff, segment.p_body_frame + R @ hold.p_segment_cuff)


def _constant(values: Float[np.ndarray, " entry"]) -> ca.SX:
    return ca.SX(ca.DM(values))


def _vector(expression: ca.SX) -> Vector:
    return np.array(ca.evalf(expression)).ravel()
