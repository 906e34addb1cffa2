"""Build the description of a picture from a machine and the body data of its wearer."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from exograv.model.anthropometry import Body
from exograv.model.arm import Arm, build_arm
from exograv.model.assembly import Assembly, adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.limb import Limb
from exograv.model.rig_settings import ArmSide
from exograv.model.tree import Tree, Vector

from .description import BodyPoint, SceneArm, SceneDescription, SceneJoint, point_of, rows_of
from .machine_shapes import LimbLine, MachineShapes
from .person_shapes import arm_radius, limb_radius, person_shapes, seat_of
from .poses import ORIGIN, Pose, body_poses, frame_point
from .visuals import read_visuals

PLACES = ("upper_arm", "forearm", "wrist", "finger_tip")
"""Frames of an arm: shoulder, elbow, wrist and finger tip."""

SEGMENTS = ("upper_arm", "forearm", "hand")


def describe_scene(
    description: RigDescription, body: Body, lengths: Mapping[str, float] | None = None
) -> SceneDescription:
    """Describe a person in a machine.

    Args:
        description: Machine.
        body: Body data of the person.
        lengths: Lengths to which the machine is set [m]; the person's if None.

    Raises:
        ModelError: The machine's files disagree, or it does not fit the person.
    """
    arm = build_arm(body, *description.arm_sides, kind=description.settings.wearer.arm)
    exo = adjusted(read_exoskeleton(description), description, lengths or arm.lengths)
    return describe_assembly(Assembly(description, exo, arm, tuple(description.settings.cuffs)), body)


def describe_assembly(assembly: Assembly, body: Body) -> SceneDescription:
    """Describe an assembled machine and arm; `body` gives girths and the rest of the person."""
    description, tree, arm = assembly.description, assembly.exo, assembly.arm
    poses = body_poses(tree, description.donning_posture)
    shoulders: dict[ArmSide, Vector] = {side: _shoulder(assembly, poses, side) for side in description.arm_sides}
    lines = {limb.side: _arm_line(assembly, limb, shoulders[limb.side]) for limb in arm.limbs}
    seat = seat_of(body, shoulders)
    radii = [1.05 * limb_radius(body, "upper_arm"), limb_radius(body, "forearm"), 0.04]
    limbs = [LimbLine(a, b, r) for line, _ in lines.values() for a, b, r in zip(line, line[1:], radii, strict=False)]
    visuals, note = read_visuals(description.urdf_path, tree)
    machine = MachineShapes(description, tree, poses, limbs, seat).shapes(frozenset(shape.body for shape in visuals))
    x, y, z = (0.5 * (seat.shoulders + seat.hips)).tolist()
    return SceneDescription(
        rig=description.name,
        title=description.settings.title,
        side=description.side,
        joints=_joints(description, tree),
        shapes=(*person_shapes(body, seat, shoulders), *visuals, *machine),
        arms=tuple(_arm(assembly, limb, poses, *lines[limb.side], body) for limb in arm.limbs),
        floor=seat.floor,
        centre=(x, y, z),
        note=note,
    )


def _joints(description: RigDescription, tree: Tree) -> tuple[SceneJoint, ...]:
    rows = zip(tree.joints, description.donning_posture.tolist(), description.settings.actuators, strict=True)
    return tuple(
        SceneJoint(
            joint.name,
            joint.kind,
            joint.parent,
            rows_of(joint.R_parent_joint),
            point_of(joint.p_parent_joint),
            point_of(joint.axis),
            joint.lower if np.isfinite(joint.lower) else None,
            joint.upper if np.isfinite(joint.upper) else None,
            rest,
            actuator.drive != "passive",
        )
        for joint, rest, actuator in rows
    )


def _shoulder(assembly: Assembly, poses: list[Pose], side: ArmSide) -> Vector:
    return frame_point(assembly.exo, poses, assembly.exo.frame(assembly.description.shoulder_centre(side)))


def _arm_line(assembly: Assembly, limb: Limb, shoulder: Vector) -> tuple[list[Vector], Vector]:
    """Return the positions of shoulder, elbow, wrist and fingertip, and the direction of the thumb, in the base.

    The arm is in the fastened cuffs, in its donning posture. Positions are in metres; the direction has length 1.
    """
    arm = assembly.arm
    poses = body_poses(arm.tree, _arm_positions(arm, assembly.description.arm_donning_posture), shoulder)
    frames = [arm.tree.frame(limb.prefix + name) for name in PLACES]
    return [frame_point(arm.tree, poses, frame) for frame in frames], poses[frames[-1].body].R[:, 0]


def _arm_positions(arm: Arm, z: Float[np.ndarray, " freedom"]) -> Float[np.ndarray, " joint"]:
    """Positions of all joints of the arm's tree, without shift of the shoulder and lengthening."""
    q = np.zeros(len(arm.tree.joints))
    for limb in arm.limbs:
        q[limb.joints] = z[limb.freedoms]
    return q


def _arm(assembly: Assembly, limb: Limb, poses: list[Pose], line: list[Vector], thumb: Vector, body: Body) -> SceneArm:
    """Arm whose elbow, wrist and finger tip move with the bodies that carry its cuffs."""
    bodies = {
        cuff.segment: assembly.exo.frame(cuff.exo_frame).body
        for cuff in assembly.cuffs
        if cuff.side in (None, limb.side)
    }
    on_upper_arm = bodies.get("upper_arm", bodies.get("forearm", -1))
    on_forearm = bodies.get("forearm", on_upper_arm)
    on_hand = bodies.get("hand", on_forearm)
    shoulder = assembly.exo.frame(assembly.description.shoulder_centre(limb.side)).body
    carriers = (shoulder, on_upper_arm, on_forearm, on_hand)
    points = [
        BodyPoint(carrier, point_of(_pose(poses, carrier).inverse_of(point)))
        for carrier, point in zip(carriers, line, strict=True)
    ]
    lengths = assembly.arm.lengths
    return SceneArm(
        limb.side,
        (lengths["upper_arm"], lengths["forearm"], lengths["hand"]),
        arm_radius(body),
        (points[0], points[1], points[2], points[3]),
        BodyPoint(on_hand, point_of(_pose(poses, on_hand).R.T @ thumb)),
    )


def _pose(poses: list[Pose], body: int) -> Pose:
    return poses[body] if body >= 0 else ORIGIN
