"""Arms of the wearer in MuJoCo: bones as bodies, freedoms as hinges, the shoulder's path as a slide."""

from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from exograv.rig.twin.machine.machine_bodies import TIMESTEP, add_weight, weight_body

from .shoulder_path import ShoulderPath
from .skeleton import Bone, BoneJoint, Skeleton

# MuJoCo moves no body without mass, so a bone that only links two joints gets a negligible mass and inertia.
MASS_LEAST = 1e-9
INERTIA_LEAST = 1e-12

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

    shift: int
    """Degree of freedom of the shoulder centre's shift; -1 if a girdle of bones moves the shoulder."""

    coupled: Int[np.ndarray, " coupling"]
    """Degrees of freedom of the joints that follow a freedom."""

    bodies: tuple[int, ...]
    """All bodies of the arm, without the weights in the hand and at the forearm."""

    @property
    def followers(self) -> list[int]:
        """Degrees of freedom of all joints that follow, in the order of `passive.follower_paths`."""
        return [*([self.shift] if self.shift >= 0 else []), *self.coupled.tolist()]


def add_arm(
    spec: mujoco.MjSpec, skeleton: Skeleton, shoulder: Float[np.ndarray, " 3"], path: ShoulderPath | None = None
) -> None:
    """Add an arm that hangs from its shoulder centre at `shoulder` [m], base axes; a foreign world has its `path`."""
    for bone in skeleton.bones:
        parent = spec.worldbody if bone.parent is None else spec.body(body_name(skeleton, bone.parent))
        body = parent.add_body(
            name=body_name(skeleton, bone.name), pos=shoulder + bone.origin if bone.parent is None else bone.origin
        )
        _add_mass(body, bone)
        if bone is skeleton.bones[0] and skeleton.follows_elevation:
            # Up and medial in equal parts, in the frontal plane (direction unverified).
            medial = 1.0 if skeleton.side == "right" else -1.0
            axis = np.array([0.0, medial, 1.0]) / np.sqrt(2.0)
            axis = axis if path is None else path.direction(axis)
            body.add_joint(name=joint_name(skeleton, "shift"), type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
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


def find_arm(model: mujoco.MjModel, skeleton: Skeleton) -> ArmPlace:
    """Return the indices of an arm that `add_arm` has put into a model."""
    return ArmPlace(
        skeleton,
        np.array([dof(model, joint_name(skeleton, freedom)) for freedom in skeleton.freedoms]),
        dof(model, joint_name(skeleton, "shift")) if skeleton.follows_elevation else -1,
        np.array([dof(model, joint_name(skeleton, one.joint)) for one in skeleton.couplings], dtype=int),
        tuple(model.body(body_name(skeleton, bone.name)).id for bone in skeleton.bones),
    )


def body_name(skeleton: Skeleton, bone: str) -> str:
    """Name of a bone's body in MuJoCo."""
    return f"wearer_{skeleton.side}_{bone}"


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


def _add_joint(body: mujoco.MjsBody, skeleton: Skeleton, joint: BoneJoint) -> None:
    kind = mujoco.mjtJoint.mjJNT_SLIDE if joint.is_slide else mujoco.mjtJoint.mjJNT_HINGE
    body.add_joint(name=joint_name(skeleton, joint.name), type=kind, axis=joint.axis, pos=joint.anchor)
