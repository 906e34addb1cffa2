"""Arms of the wearer in MuJoCo: bones as bodies, freedoms as hinges, the shoulder's path as a slide."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from jaxtyping import Float, Int

from exograv.rig.twin.machine.machine_bodies import TIMESTEP, add_weight, weight_body

from .curved_path import CurvedPath
from .shoulder_path import ShoulderPath
from .skeleton import Bone, BoneJoint, Skeleton
from .strained_cuffs import SoftTissue
from .wearer import WearerArm

# MuJoCo moves no body without mass, so a bone that only links two joints gets a negligible mass and inertia.
MASS_LEAST = 1e-9
INERTIA_LEAST = 1e-12

SHIFTS = "shift", "shift_across"
"""Names of the slides of a shoulder's centre: along its path, and across it where the path is curved."""

SOFT = "_soft"
"""End of the name of a body that is the soft tissue of a bone."""

# MuJoCo's own constraint holds coupled joints, as stiffly as its time step allows.
COUPLING_SOLREF = (2.0 * TIMESTEP, 1.0)
COUPLING_SOLIMP = (0.99, 0.999, 0.001, 0.5, 2.0)
EQUALITY_NUMBERS = 12
"""Size of a constraint's data in MuJoCo's specification; a polynomial uses the first five numbers."""


@dataclass(frozen=True)
class ArmPlace:
    """Indices of one arm in a compiled scene."""

    skeleton: Skeleton
    freedoms: Int[np.ndarray, " freedom"]
    """Degrees of freedom of the arm's joints, in the order of `Skeleton.freedoms`."""

    shifts: tuple[int, ...]
    """Degrees of freedom of the shoulder centre's shift, two on a curved path, none if bones move the shoulder."""

    coupled: Int[np.ndarray, " coupling"]
    """Degrees of freedom of the joints that follow a freedom."""

    bodies: tuple[int, ...]
    """All bodies of the arm, without the weights in the hand and at the forearm."""

    soft: Mapping[int, SoftTissue]
    """Soft tissue by its body, in a world that has it."""

    @property
    def followers(self) -> list[int]:
        """Degrees of freedom of all joints that follow, in the order of `passive.follower_paths`."""
        return [*self.shifts, *self.coupled.tolist()]


def add_arm(
    spec: mujoco.MjSpec,
    arm: WearerArm,
    shoulder: Float[np.ndarray, " 3"],
    path: ShoulderPath | CurvedPath | None = None,
) -> None:
    """Add an arm that hangs from its shoulder centre at `shoulder` [m], base axes; a foreign world has its `path`."""
    skeleton = arm.skeleton
    soft_tissue = {skeleton.held[segment]: soft for segment, soft in arm.soft_tissue.items()}
    for bone in skeleton.bones:
        parent = spec.worldbody if bone.parent is None else spec.body(body_name(skeleton, bone.parent))
        body = parent.add_body(
            name=body_name(skeleton, bone.name), pos=shoulder + bone.origin if bone.parent is None else bone.origin
        )
        if bone.name in soft_tissue and bone.mass > 0.0:
            _add_soft_tissue(body, skeleton, bone, soft_tissue[bone.name])
        else:
            _add_mass(body, bone)
        if bone is skeleton.bones[0] and skeleton.follows_elevation:
            # Up and medial in equal parts, in the frontal plane (direction unverified).
            medial = 1.0 if skeleton.side == "right" else -1.0
            axis = np.array([0.0, medial, 1.0]) / np.sqrt(2.0)
            axes = (axis,) if path is None else path.directions(axis)
            for name, one in zip(SHIFTS, axes, strict=False):
                body.add_joint(name=joint_name(skeleton, name), type=mujoco.mjtJoint.mjJNT_SLIDE, axis=one)
        for joint in bone.joints:
            _add_joint(body, skeleton, joint)
    for coupling in skeleton.couplings:
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=joint_name(skeleton, coupling.joint),
            name2=joint_name(skeleton, coupling.freedom),
            data=np.pad(coupling.polynomial, (0, EQUALITY_NUMBERS - len(coupling.polynomial))),
            solref=COUPLING_SOLREF,
            solimp=COUPLING_SOLIMP,
        )
    for where, (bone, place) in {"hand": skeleton.grip, "forearm": skeleton.mid_forearm}.items():
        add_weight(spec.body(body_name(skeleton, bone)), weight_body(f"{skeleton.side}_{where}"), place)


def find_arm(model: mujoco.MjModel, arm: WearerArm) -> ArmPlace:
    """Return the indices of an arm that `add_arm` has put into a model."""
    skeleton = arm.skeleton
    soft = {name: mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, soft_name(skeleton, name)) for name in _names(arm)}
    return ArmPlace(
        skeleton,
        np.array([dof(model, joint_name(skeleton, freedom)) for freedom in skeleton.freedoms]),
        _shifts(model, skeleton),
        np.array([dof(model, joint_name(skeleton, one.joint)) for one in skeleton.couplings], dtype=int),
        (
            *(model.body(body_name(skeleton, bone.name)).id for bone in skeleton.bones),
            *(body for body in soft.values() if body >= 0),
        ),
        {body: tissue for segment, tissue in arm.soft_tissue.items() if (body := soft[skeleton.held[segment]]) >= 0},
    )


def _shifts(model: mujoco.MjModel, skeleton: Skeleton) -> tuple[int, ...]:
    """Return the degrees of freedom of the slides that a model has for one shoulder's centre."""
    names = [joint_name(skeleton, name) for name in SHIFTS]
    found = [name for name in names if mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0]
    return tuple(dof(model, name) for name in found)


def _names(arm: WearerArm) -> list[str]:
    """Return the bones that soft tissue may hang on."""
    return [arm.skeleton.held[segment] for segment in arm.soft_tissue]


def let_soft_tissue_hang(data: mujoco.MjData, arms: Sequence[ArmPlace]) -> None:
    """Put soft tissue where its springs carry its weight; positions of the bodies must be known.

    A point mass on springs that are alike in all directions is displaced along gravity, so that its moment about any
    joint stays the same. Statics therefore leaves the springs at rest.
    """
    model = data.model
    for arm in arms:
        for body, soft in arm.soft.items():
            R_world_bone = data.xmat[model.body_parentid[body]].reshape(3, 3)
            first = int(model.jnt_qposadr[model.body_jntadr[body]])
            data.qpos[first : first + 3] = R_world_bone.T @ model.opt.gravity / soft.natural**2


def body_name(skeleton: Skeleton, bone: str) -> str:
    """Name of a bone's body in MuJoCo."""
    return f"wearer_{skeleton.side}_{bone}"


def soft_name(skeleton: Skeleton, bone: str) -> str:
    """Name of the body of a bone's soft tissue in MuJoCo."""
    return f"{body_name(skeleton, bone)}{SOFT}"


def joint_name(skeleton: Skeleton, joint: str) -> str:
    """Name of a freedom or follower in MuJoCo."""
    return f"wearer_{skeleton.side}_{joint}"


def dof(model: mujoco.MjModel, joint: str) -> int:
    """Degree of freedom of a joint. Each joint here has one, so that positions and velocities have the same address."""
    return int(model.joint(joint).dofadr[0])


def _add_mass(body: mujoco.MjsBody, bone: Bone) -> None:
    body.explicitinertial = True
    body.mass, body.ipos = max(bone.mass, MASS_LEAST), bone.com
    inertia = bone.inertia if bone.mass > 0.0 else INERTIA_LEAST * np.eye(3)
    body.fullinertia = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _add_soft_tissue(body: mujoco.MjsBody, skeleton: Skeleton, bone: Bone, soft: SoftTissue) -> None:
    """Add a bone without a part of its mass, and this part as a point mass on springs at the bone's centre of mass.

    While the springs are at rest, mass, first moments and inertia of both together are those of the whole bone.
    """
    mass = soft.share * bone.mass
    _add_mass(body, replace(bone, mass=bone.mass - mass))
    flesh = body.add_body(name=soft_name(skeleton, bone.name), pos=bone.com)
    flesh.explicitinertial = True
    flesh.mass, flesh.ipos, flesh.inertia = mass, np.zeros(3), np.full(3, INERTIA_LEAST)
    for name, axis in zip("xyz", np.eye(3), strict=True):
        flesh.add_joint(
            name=f"{soft_name(skeleton, bone.name)}_{name}",
            type=mujoco.mjtJoint.mjJNT_SLIDE,
            axis=axis,
            stiffness=mass * soft.natural**2,
            damping=2.0 * soft.damping_ratio * mass * soft.natural,
        )


def _add_joint(body: mujoco.MjsBody, skeleton: Skeleton, joint: BoneJoint) -> None:
    kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.is_slide else mujoco.mjtJoint.mjJNT_HINGE
    body.add_joint(name=joint_name(skeleton, joint.name), type=kind, axis=joint.axis, pos=joint.anchor)
