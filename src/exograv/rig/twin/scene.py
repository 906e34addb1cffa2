"""The twin's two trees in MuJoCo: the machine as built, and inside it the wearer's arm, joined only by forces."""

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np
from jaxtyping import Float, Int

from exograv.errors import ModelError, RigError
from exograv.model.description import RigDescription

from .machine import Machine
from .wearer import ARM_JOINTS, Wearer

TIMESTEP = 0.0005
"""[s]"""

# Hard stops lie 5° beyond the limits that software keeps. As in AGREE.
HARD_STOP_MARGIN = np.deg2rad(5.0)

SHIFT_JOINT = "arm_shoulder_shift"
WEIGHTS: Mapping[str, str] = {"calibration": "weight_at_calibration_mount", "hand": "weight_at_hand"}
"""Bodies without mass where a known weight can hang."""

# MuJoCo would fuse fixed frames into their parents and lose the cuffs; only the compiler's own tag, read with the file,
# prevents it.
COMPILER = '<mujoco><compiler discardvisual="false" fusestatic="false" strippath="false"/></mujoco>'


@dataclass(frozen=True)
class CuffPlace:
    """A cuff in both trees, fastened without strain at the donning posture."""

    name: str
    exo_body: int
    arm_body: int
    p_arm: Float[np.ndarray, " 3"]
    """Cuff's origin in the frame of the arm's segment [m]."""

    R_arm: Float[np.ndarray, "3 3"]
    """Cuff's axes in the frame of the arm's segment."""


@dataclass(frozen=True)
class Scene:
    """A compiled world; `model` and its two `MjData` are its only mutable parts."""

    model: mujoco.MjModel
    data: mujoco.MjData
    scratch: mujoco.MjData
    """For MuJoCo's own constants, which leave it at the zero posture."""

    exo: Int[np.ndarray, " joint"]
    """Degrees of freedom of the machine's joints, in the description's order."""

    arm: Int[np.ndarray, " arm"]
    """Degrees of freedom of the arm's joints, in the order of `ARM_JOINTS`; empty without a wearer."""

    shift: int
    """Degree of freedom of the shoulder centre's shift; -1 without a wearer."""

    cuffs: tuple[CuffPlace, ...]

    def hang(self, mount: str, mass: float) -> None:
        """Put a point mass [kg] at a mount; it replaces the one that hung there.

        Raises:
            RigError: No such mount, no wearer to hold it, or a negative mass.
        """
        body = mujoco.mj_name2id(self.model, mujoco.mjtObj.mjOBJ_BODY, WEIGHTS.get(mount, mount))
        if body < 0:
            raise RigError(f"Nothing can hang at '{mount}' here; mounts are calibration and, with a wearer, hand.")
        if not mass >= 0.0:
            raise RigError(
                f"A weight of {mass} kg cannot hang at '{mount}'; give zero to take it off, or a positive mass."
            )
        if self.model.body_mass[body] != mass:
            self.model.body_mass[body] = mass
            mujoco.mj_setConst(self.model, self.scratch)


def build_scene(
    description: RigDescription,
    machine: Machine,
    wearer: Wearer | None,
    lengths: Mapping[str, float] | None = None,
) -> Scene:
    """The world of one machine and one wearer.

    Args:
        description: The machine as its folder describes it.
        machine: How it differs.
        wearer: Who is in it; `None` leaves it empty.
        lengths: What the machine's adjustable lengths are set to, by segment [m]; where absent, those
            measured on the wearer.
    """
    spec = _machine_spec(description, machine, lengths or (wearer.lengths_given if wearer else {}))
    if wearer is not None:
        _add_arm(spec, wearer, _shoulder_centre(spec, description) + wearer.donning_offset)
    model = spec.compile()
    # MuJoCo would otherwise put a diverged world back to its beginning and carry on.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if model.opt.jacobian != mujoco.mjtJacobian.mjJAC_DENSE:
        raise RigError(
            "MuJoCo did not keep the dense Jacobian; its sparse solver has a wrong Hessian in some releases."
        )
    data, scratch = mujoco.MjData(model), mujoco.MjData(model)
    exo = np.array([_dof(model, joint) for joint in description.joints])
    if wearer is None:
        return Scene(model, data, scratch, exo, np.array([], dtype=int), -1, ())
    arm = np.array([_dof(model, f"arm_{joint}") for joint in ARM_JOINTS])
    cuffs = _fasten_cuffs(description, model, data, exo, arm)
    return Scene(model, data, scratch, exo, arm, _dof(model, SHIFT_JOINT), cuffs)


def _machine_spec(description: RigDescription, machine: Machine, lengths: Mapping[str, float]) -> mujoco.MjSpec:
    text = description.urdf_path.read_text(encoding="utf-8")
    head = text.index(">", text.index("<robot")) + 1
    try:
        spec = mujoco.MjSpec.from_string(text[:head] + COMPILER + text[head:])
    except ValueError as error:
        raise ModelError(f"MuJoCo cannot read {description.urdf_path.name}: {error}. Correct the URDF.") from error
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.gravity = machine.gravity
    _set_lengths(spec, description, lengths)
    _build_with_errors(spec, machine)
    _fit_joints(spec, description, machine)
    for mount in description.mounts[:1]:
        _add_weight(spec.body(mount), WEIGHTS["calibration"], np.zeros(3))
    return spec


def _set_lengths(spec: mujoco.MjSpec, description: RigDescription, lengths: Mapping[str, float]) -> None:
    for adjustment in description.settings.adjustments:
        # A machine can only be set as far as it goes; someone taller or smaller gets the end of its range.
        wanted = lengths.get(adjustment.segment, adjustment.nominal_m)
        length = float(np.clip(wanted, adjustment.min_m, adjustment.max_m))
        body = spec.joint(adjustment.joint).parent
        k = "xyz".index(adjustment.axis)
        body.pos[k] = np.copysign(length, body.pos[k])


def _build_with_errors(spec: mujoco.MjSpec, machine: Machine) -> None:
    for body in spec.bodies:
        if body.explicitinertial:
            factor, shift = machine.link_error(body.name)
            body.mass *= factor
            body.fullinertia = factor * np.asarray(body.fullinertia)
            body.ipos = np.asarray(body.ipos) + shift


def _fit_joints(spec: mujoco.MjSpec, description: RigDescription, machine: Machine) -> None:
    """Friction and gears are the twin's own forces; MuJoCo keeps only the hard stops and the rotors of rigid gears."""
    drives = machine.drives
    rigid = dict(zip(description.joints, np.isinf(drives.gear_stiffness), strict=True))
    rotors = dict(zip(description.joints, drives.rotor_inertia, strict=True))
    for joint in spec.joints:
        joint.damping = np.zeros(3)
        joint.frictionloss = 0.0
        joint.range = np.asarray(joint.range) + HARD_STOP_MARGIN * np.array([-1.0, 1.0])
        if rigid.get(joint.name, False):
            joint.armature = rotors[joint.name]


def _shoulder_centre(spec: mujoco.MjSpec, description: RigDescription) -> Float[np.ndarray, " 3"]:
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return data.body(description.shoulder_centre(description.arm_sides[0])).xpos.copy()


def _add_arm(spec: mujoco.MjSpec, wearer: Wearer, shoulder: Float[np.ndarray, " 3"]) -> None:
    upper_arm, forearm, hand = (wearer.segments[name] for name in ("upper_arm", "forearm", "hand"))
    outward = -1.0 if wearer.side == "right" else 1.0  # sign of y away from the trunk
    upper = _add_segment(spec.worldbody, "arm_upper_arm", shoulder, upper_arm)
    slide = mujoco.mjtJoint.mjJNT_SLIDE
    # Up and medial in equal parts, in the frontal plane (direction unverified).
    upper.add_joint(name=SHIFT_JOINT, type=slide, axis=np.array([0.0, -outward, 1.0]) / np.sqrt(2.0))
    axes = [[0.0, -1.0, 0.0], [outward, 0.0, 0.0], [0.0, 0.0, -outward]]
    for joint, axis in zip(ARM_JOINTS[:3], axes, strict=True):
        upper.add_joint(name=f"arm_{joint}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
    lower = _add_segment(upper, "arm_forearm", np.array([0.0, 0.0, -upper_arm.length]), forearm)
    lower.add_joint(name=f"arm_{ARM_JOINTS[3]}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, -1.0, 0.0])
    _add_segment(lower, "arm_hand", np.array([0.0, 0.0, -forearm.length]), hand)
    _add_weight(lower, WEIGHTS["hand"], wearer.grip)


def _add_segment(parent: mujoco.MjsBody, name: str, pos: Float[np.ndarray, " 3"], segment) -> mujoco.MjsBody:
    body = parent.add_body(name=name, pos=pos)
    body.explicitinertial = True
    body.mass, body.ipos = segment.mass, segment.com
    body.fullinertia = segment.inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
    return body


def _add_weight(parent: mujoco.MjsBody, name: str, pos: Float[np.ndarray, " 3"]) -> None:
    body = parent.add_body(name=name, pos=pos)
    body.explicitinertial = True
    # The centre must be told: MuJoCo would take the body's place in its parent for it.
    body.mass, body.ipos = 0.0, np.zeros(3)


def _fasten_cuffs(
    description: RigDescription,
    model: mujoco.MjModel,
    data: mujoco.MjData,
    exo: Int[np.ndarray, " joint"],
    arm: Int[np.ndarray, " arm"],
) -> tuple[CuffPlace, ...]:
    # The order of freedoms of the machine is the arm's, so that both take the same angles when the cuffs are fastened.
    data.qpos[exo] = data.qpos[arm] = description.donning_posture
    mujoco.mj_kinematics(model, data)
    places = []
    for cuff in description.settings.cuffs:
        on_exo, on_arm = data.body(cuff.exo_frame), data.body(f"arm_{cuff.segment}")
        R_world_arm = on_arm.xmat.reshape(3, 3)
        p_arm = R_world_arm.T @ (on_exo.xpos - on_arm.xpos)
        R_arm = R_world_arm.T @ on_exo.xmat.reshape(3, 3)
        places.append(CuffPlace(cuff.name, on_exo.id, on_arm.id, p_arm, R_arm))
    return tuple(places)


def _dof(model: mujoco.MjModel, joint: str) -> int:
    # Every joint here has one freedom, so that positions and velocities have the same address.
    return int(model.joint(joint).dofadr[0])
