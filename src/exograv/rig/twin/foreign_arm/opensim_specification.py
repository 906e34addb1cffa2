"""MuJoCo specification of an OpenSim arm: each coordinate that moves the arm is a joint of that name."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import mujoco
import numpy as np
from jaxtyping import Float
from numpy.polynomial import Polynomial

from exograv.errors import ModelError

from .model_joints import listed
from .opensim.document import GROUND, OsimBody, OsimDocument, OsimJoint
from .opensim.functions import after, line_of, powers_about
from .opensim.joints import Axis
from .opensim.kinematics import OsimKinematics
from .opensim.turns import turn
from .wearer_map import WearerMap

ERROR_MAX_RAD = np.deg2rad(1.0)
"""Largest error of a polynomial that stands for a joint's transform [rad]: far below that of a cuff on skin."""

ERROR_MAX_M = 0.002
"""Largest such error of a sliding axis [m]."""


@dataclass
class _Arm:
    """Arm that is being written."""

    document: OsimDocument
    kinematics: OsimKinematics
    named: frozenset[str]
    """Coordinates that the map names."""

    mapped: frozenset[str]
    """Coordinates that are freedoms of the arm."""

    moving: frozenset[str]
    """Bodies whose joints move."""

    spec: mujoco.MjSpec
    rigid: list[str] = field(default_factory=list)
    fitted: list[str] = field(default_factory=list)


def arm_specification(document: OsimDocument, told: WearerMap) -> tuple[mujoco.MjSpec, tuple[str, ...]]:
    """Return the arm that the map names, with the bodies that carry it, and notes about parts that are not used.

    Raises:
        ModelError: A body or joint of this arm is not there or cannot be represented.
    """
    for name in (told.segments.hand, told.segments.forearm, told.segments.upper_arm):
        if name not in document.bodies:
            raise ModelError(f"segments: no body '{name}' in the model. Bodies there: {listed(list(document.bodies))}.")
    named = frozenset(
        [one.joint for one in told.freedoms.values()]
        + [*(told.shoulder.joints if told.shoulder else ()), *told.locked, *told.coupled]
    )
    kinematics = OsimKinematics(document)
    kept, moving = _bodies_of_arm(document, kinematics, told, named)
    spec = mujoco.MjSpec()
    spec.compiler.degree = False
    mapped = frozenset(one.joint for one in told.freedoms.values())
    arm = _Arm(document, kinematics, named, mapped, moving, spec)
    _write(arm, spec.worldbody, GROUND, kept)
    return spec, _notes(arm, kept)


def _bodies_of_arm(
    document: OsimDocument, kinematics: OsimKinematics, told: WearerMap, named: frozenset[str]
) -> tuple[list[str], frozenset[str]]:
    """Return the bodies that are kept, in the file's order, and those of them that move."""
    path = document.path_to(told.segments.hand)
    roots = [
        body for body in path if any(_leads(kinematics, one.name, named) for one in document.joints[body].coordinates)
    ]
    points = [point.body for point in (told.points.wrist, told.points.finger_tip) if point is not None]
    ends = {told.segments.hand, told.segments.forearm, told.segments.upper_arm, *points} & set(document.bodies)
    ends |= {body for body, one in document.coordinates() if one.name in named}
    kept = {one for end in ends for one in document.path_to(end)}
    moving = {body for body, one in document.coordinates() if one.name in named}
    moving |= {body for body in document.bodies if roots and document.carries(roots[0], body)}
    return [body for body in document.bodies if body in kept | moving], frozenset(moving)


def _leads(kinematics: OsimKinematics, coordinate: str, named: frozenset[str]) -> bool:
    """Return True if the map names the coordinate, or the one that it follows."""
    return coordinate in named or (
        coordinate in kinematics.document.couplings and kinematics.drive(coordinate).root in named
    )


def _write(arm: _Arm, parent: mujoco.MjsBody, name: str, kept: list[str]) -> None:
    for child in kept:
        if arm.document.joints[child].parent == name:
            T = arm.kinematics.place(child)
            body = parent.add_body(name=child, pos=T[:3, 3], quat=_quaternion(T))
            if child in arm.moving:  # the masses above do not move with the arm
                _put_mass(body, arm.document.bodies[child])
                _put_joints(arm, body, arm.document.joints[child])
            _write(arm, body, child, kept)


def _put_mass(body: mujoco.MjsBody, own: OsimBody) -> None:
    body.mass, body.ipos, body.explicitinertial = own.mass, own.com, True
    if own.inertia[3:].any():
        body.fullinertia = own.inertia
    else:
        body.inertia = own.inertia[:3]


def _put_joints(arm: _Arm, body: mujoco.MjsBody, joint: OsimJoint) -> None:
    """Add the joints of a body, slides first: OpenSim moves along the parent's axes and turns afterwards."""
    moves = [axis for axis in joint.axes if axis.coordinate and _moves(arm, axis.coordinate)]
    arm.rigid += [
        one.name
        for one in joint.coordinates
        if one.is_locked and not _moves(arm, one.name) and one.name not in arm.rigid
    ]
    own = {name: _own_axis(arm, joint, name) for name in dict.fromkeys(axis.coordinate for axis in moves)}
    R_child_M, anchor = joint.T_child_M[:3, :3], joint.T_child_M[:3, 3]
    turned = arm.kinematics.turned(joint)[:3, :3]
    directions = _directions(arm, joint, turned)
    for axis in sorted(moves, key=lambda one: not one.is_slide):
        is_own = own[axis.coordinate] is axis
        slope = (line_of(axis.function) or (1.0, 0.0))[0] if is_own else 1.0
        name = axis.coordinate if is_own else f"{joint.name}_{axis.name}"
        value = arm.kinematics.value(axis.coordinate)
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_SLIDE if axis.is_slide else mujoco.mjtJoint.mjJNT_HINGE,
            pos=anchor,
            axis=slope * R_child_M @ directions[axis.name],
            ref=value if is_own else axis.function(value),
        )
        _put_coupling(arm, name, axis, is_own)


def _moves(arm: _Arm, coordinate: str) -> bool:
    """Return True if the coordinate is not locked, and follows none that does not move."""
    root = arm.kinematics.drive(coordinate).root
    child = next((body for body, one in arm.document.coordinates() if one.name == root), None)
    return coordinate in arm.named or (
        child in arm.moving and (root in arm.named or not arm.kinematics.coordinates[root].is_locked)
    )


def _own_axis(arm: _Arm, joint: OsimJoint, coordinate: str) -> Axis | None:
    """Return the axis that moves as far as the coordinate itself; a coordinate that follows another one needs none."""
    for axis in joint.axes:
        line = line_of(axis.function)
        if axis.coordinate == coordinate and line is not None and np.isclose(abs(line[0]), 1.0, atol=1e-9):
            return axis
    if coordinate in arm.document.couplings:
        return None
    raise ModelError(
        f"{arm.document.path}: joint '{joint.name}' has no axis that moves as far as its coordinate '{coordinate}'. "
        "Give one axis a LinearFunction with slope 1 or -1, or lock the coordinate."
    )


def _directions(arm: _Arm, joint: OsimJoint, turned: Float[np.ndarray, "3 3"]) -> Mapping[str, Float[np.ndarray, " 3"]]:
    """Return the axes of a joint at its default posture, in the child's joint frame.

    With R1 R2 R3 as the default turns,

        R1 exp(a1) R2 exp(a2) R3 exp(a3) = R1 R2 R3 exp((R2 R3)ᵀ a1) exp(R3ᵀ a2) exp(a3)
    """
    directions = {}
    after_it = np.eye(3)
    for axis in reversed(joint.axes):
        if axis.is_slide:
            directions[axis.name] = turned.T @ axis.direction
        else:
            directions[axis.name] = after_it.T @ axis.direction
            value = axis.function(arm.kinematics.value(axis.coordinate) if axis.coordinate else 0.0)
            after_it = turn(axis.direction, value) @ after_it
    return directions


def _put_coupling(arm: _Arm, name: str, axis: Axis, is_own: bool) -> None:
    """Couple a joint to the coordinate that determines its position, unless the joint is this coordinate."""
    drive = arm.kinematics.drive(axis.coordinate)
    identity = Polynomial([0.0, 1.0])
    law = after(identity if is_own else axis.function, drive.law or identity)
    if (is_own and drive.law is None) or not _moves(arm, drive.root):
        return
    root = arm.kinematics.coordinates[drive.root]
    # Some files have a range of ±100 000 rad, which says that there is none.
    low, high = np.clip([root.low, root.high], -np.pi, np.pi)
    powers, error = powers_about(law, root.default, float(low), float(high))
    allowed, unit, factor = (ERROR_MAX_M, "m", 1.0) if axis.is_slide else (ERROR_MAX_RAD, "°", np.rad2deg(1.0))
    if drive.root in arm.mapped and name not in arm.named and error > 1e-9:
        if error > allowed:
            raise ModelError(
                f"{arm.document.path}: '{name}' follows '{drive.root}' by a function that no polynomial of degree 4 "
                f"matches: the largest error is {factor * error:.2g} {unit}; allowed: {factor * allowed:.2g} {unit}. "
                "Narrow the coordinate's range, or lock it."
            )
        arm.fitted.append(f"{name} (largest error {factor * error:.2g} {unit})")
    equality = arm.spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, name1=name, name2=drive.root)
    equality.data[:5] = [0.0, *powers[1:]]  # MuJoCo counts both joints from their default


def _quaternion(T: Float[np.ndarray, "4 4"]) -> Float[np.ndarray, " 4"]:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, T[:3, :3].ravel())
    return quaternion


def _notes(arm: _Arm, kept: list[str]) -> tuple[str, ...]:
    document = arm.document
    notes = []
    others = len(document.bodies) - len(kept)
    if others:
        notes.append(f"Bodies that belong to no part of this arm are left out: {others}.")
    for counts, what in ((document.forces, "forces and muscles"), (document.constraints, "constraints")):
        if counts:
            kinds = ", ".join(f"{count} {kind}" for kind, count in counts.items())
            notes.append(f"All {what} of the model are left out: {kinds}.")
    if arm.rigid:
        notes.append(f"Locked in the file, and rigid here: {listed(arm.rigid)}.")
    if arm.fitted:
        notes.append(f"Polynomials of degree 4 stand for the transforms of {listed(arm.fitted)}.")
    return tuple(notes)
