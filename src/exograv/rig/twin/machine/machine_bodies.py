"""Bodies of the machine in MuJoCo: its URDF, set to the wearer's lengths, with the errors of this machine."""

from collections.abc import Mapping

import mujoco
import numpy as np
from jaxtyping import Float

from exograv.errors import ModelError
from exograv.model.description import RigDescription

from .machine import Machine

TIMESTEP = 0.0005
"""Time step of the simulation [s]."""

# Hard stops lie 5° beyond the limits that the software keeps, as in AGREE.
HARD_STOP_MARGIN = np.deg2rad(5.0)

# MuJoCo would fuse fixed frames into their parents, and the cuffs would be lost. Only the compiler's own tag, read with
# the file, prevents this.
COMPILER = '<mujoco><compiler discardvisual="false" fusestatic="false" strippath="false"/></mujoco>'


def machine_spec(description: RigDescription, machine: Machine, lengths: Mapping[str, float]) -> mujoco.MjSpec:
    """Return the machine, adjusted to these lengths by segment [m]; its weights hang at bodies of `weight_body`.

    Raises:
        ModelError: MuJoCo cannot read the URDF.
    """
    text = description.urdf_text()
    head = text.index(">", text.index("<robot")) + 1
    try:
        spec = mujoco.MjSpec.from_string(text[:head] + COMPILER + text[head:])
    except ValueError as error:
        what = " ".join(str(error).split())
        raise ModelError(f"MuJoCo cannot read {description.urdf_path.name}: {what}. Correct the URDF.") from error
    spec.option.timestep = TIMESTEP
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_EULER
    spec.option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    spec.option.gravity = machine.gravity
    _set_lengths(spec, description, lengths)
    if machine.links is None:
        _build_with_errors(spec, machine)
    else:
        _build_with_links(spec, machine.links)
    _fit_joints(spec, description, machine)
    for mount in description.mounts:
        add_weight(spec.body(mount), weight_body(mount), np.zeros(3))
    return spec


def _set_lengths(spec: mujoco.MjSpec, description: RigDescription, lengths: Mapping[str, float]) -> None:
    for adjustment in description.settings.adjustments:
        # The range of the adjustment is limited: a taller or smaller wearer gets the end of the range.
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


def _build_with_links(spec: mujoco.MjSpec, links: Mapping[str, Float[np.ndarray, " 10"]]) -> None:
    """Give the body behind each joint all mass of the bodies that are fixed to it."""
    for body in spec.bodies:
        if body.explicitinertial:
            body.mass, body.ipos, body.inertia = 0.0, np.zeros(3), np.zeros(3)
            body.fullinertia = np.full(6, np.nan)  # absent: MuJoCo refuses a full inertia of zeros
    for joint in spec.joints:
        phi = links.get(joint.name)
        if phi is None:
            continue
        body, mass, com = joint.parent, float(phi[0]), np.asarray(phi[1:4]) / phi[0]
        xx, xy, yy, xz, yz, zz = phi[4:]
        about_joint = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        about_com = about_joint - mass * (com @ com * np.eye(3) - np.outer(com, com))
        body.explicitinertial = True
        body.mass, body.ipos = mass, com
        body.fullinertia = about_com[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]


def _fit_joints(spec: mujoco.MjSpec, description: RigDescription, machine: Machine) -> None:
    """Keep only the hard stops and the rotors of rigid gears in MuJoCo; the twin computes friction and gears itself."""
    drives = machine.drives
    rigid = dict(zip(description.joints, np.isinf(drives.gear_stiffness), strict=True))
    rotors = dict(zip(description.joints, drives.rotor_inertia, strict=True))
    for joint in spec.joints:
        joint.damping = np.zeros(3)
        joint.frictionloss = 0.0
        joint.range = np.asarray(joint.range) + HARD_STOP_MARGIN * np.array([-1.0, 1.0])
        if rigid.get(joint.name, False):
            joint.armature = rotors[joint.name]


def add_weight(parent: mujoco.MjsBody, name: str, pos: Float[np.ndarray, " 3"]) -> None:
    """Add a body without mass at a position in its parent [m], where a known weight can hang."""
    body = parent.add_body(name=name, pos=pos)
    body.explicitinertial = True
    # The centre of mass must be given: MuJoCo would otherwise use the position of the body in its parent.
    body.mass, body.ipos = 0.0, np.zeros(3)


def weight_body(mount: str) -> str:
    """Name of the body that represents a weight at a mount."""
    return f"weight_at_{mount}"
