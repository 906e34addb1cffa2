"""World of the twin in MuJoCo: the machine as built, and the wearer's arms.

Only forces connect the arms to the machine.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import mujoco
import numpy as np
from jaxtyping import Float, Int

from exograv.errors import RigError
from exograv.model.description import RigDescription
from exograv.rig.twin.machine.machine import Machine
from exograv.rig.twin.machine.machine_bodies import TIMESTEP as TIMESTEP
from exograv.rig.twin.machine.machine_bodies import machine_spec, weight_body
from exograv.rig.twin.wearer.arm_bodies import ArmPlace, add_arm, body_name, dof, find_arm
from exograv.rig.twin.wearer.passive import follower_paths
from exograv.rig.twin.wearer.posture import lying_like
from exograv.rig.twin.wearer.wearer import Wearer

from .surroundings import Surroundings, add_surroundings


@dataclass(frozen=True)
class CuffPlace:
    """Cuff in the trees of machine and arm, without strain at the donning posture."""

    name: str
    exo_body: int
    p_exo: Float[np.ndarray, " 3"]
    """Place of the machine's side in the link that bears it [m], as fastened."""

    arm_body: int
    p_arm: Float[np.ndarray, " 3"]
    """Origin of the cuff in the frame of the arm's bone [m]."""

    R_arm: Float[np.ndarray, "3 3"]
    """Axes of the cuff in the frame of the arm's bone."""

    holds: Float[np.ndarray, " 6"]
    """1 where the cuff holds, 0 where the machine leaves it free: along x, y, z, then about x, y, z [-]."""


@dataclass(frozen=True)
class Scene:
    """Compiled world; `model` and its two `MjData` are its only mutable parts."""

    model: mujoco.MjModel
    data: mujoco.MjData
    scratch: mujoco.MjData
    """Buffer in which MuJoCo computes its constants, which leaves it at the zero posture."""

    exo: Int[np.ndarray, " joint"]
    """Degrees of freedom of the machine's joints, in the description's order."""

    arms: tuple[ArmPlace, ...]
    """Arms of the wearer, the right one first; empty without a wearer."""

    cuffs: tuple[CuffPlace, ...]
    fastened: tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " arm"]]
    """Postures of machine and arms in which the cuffs were fastened [rad]."""

    moves_alike: bool
    """True if the machine's joints are the arms' freedoms, in the same order."""

    mounts: Mapping[str, int]
    """Bodies that represent weights, by the names under which weights hang."""

    @cached_property
    def arm(self) -> Int[np.ndarray, " arm"]:
        """MuJoCo indices of the degrees of freedom of all arms' joints; empty without a wearer."""
        return np.array([i for arm in self.arms for i in arm.freedoms], dtype=int)

    @cached_property
    def followers(self) -> Int[np.ndarray, " follower"]:
        """Degrees of freedom of all joints that follow the arms' freedoms, in the order of `passive.follower_paths`."""
        return np.array([i for arm in self.arms for i in arm.followers], dtype=int)

    def hang(self, mount: str, mass: float) -> None:
        """Put a point mass [kg] at a mount. It replaces the previous one.

        Raises:
            RigError: The mount does not exist, the machine has no wearer to hold the weight, or the mass is negative.
        """
        if mount not in self.mounts:
            raise RigError(f"Nothing can hang at '{mount}': no such mount. Mounts: {', '.join(self.mounts)}.")
        if not mass >= 0.0:
            raise RigError(
                f"A weight of {mass} kg cannot hang at '{mount}'; give zero to take it off, or a positive mass."
            )
        body = self.mounts[mount]
        if self.model.body_mass[body] != mass:
            self.model.body_mass[body] = mass
            mujoco.mj_setConst(self.model, self.scratch)

    def slide_cuff(self, name: str, along_m: float) -> None:
        """Move the machine's side of a cuff along its z axis, the limb, from where it was fastened [m].

        Raises:
            RigError: The cuff does not exist, or the machine has no wearer.
        """
        place = next((place for place in self.cuffs if place.name == name), None)
        if place is None:
            raise RigError(f"No cuff '{name}' can slide. Cuffs: {', '.join(place.name for place in self.cuffs)}.")
        R_parent_cuff = np.empty(9)
        mujoco.mju_quat2Mat(R_parent_cuff, self.model.body_quat[place.exo_body])
        self.model.body_pos[place.exo_body] = place.p_exo + along_m * R_parent_cuff.reshape(3, 3)[:, 2]


def build_scene(
    description: RigDescription,
    machine: Machine,
    wearer: Wearer | None,
    lengths: Mapping[str, float] | None = None,
    surroundings: Surroundings | None = None,
) -> Scene:
    """Build the world of one machine and one wearer.

    Args:
        description: Machine as its folder describes it.
        machine: True parameters of the machine.
        wearer: Wearer in the machine; `None` leaves it empty.
        lengths: Settings of the machine's adjustable lengths by segment [m]; if absent, those measured on the wearer.
        surroundings: Objects that the wearer's hand can touch; an empty room if absent.
    """
    spec = machine_spec(description, machine, lengths or (wearer.lengths_given if wearer else {}))
    if wearer is not None:
        centres = _shoulder_centres(spec, description)
        for arm in wearer.arms:
            add_arm(spec, arm, centres[arm.side] + arm.donning_offset, wearer.shoulder_path)
    if surroundings is not None:
        add_surroundings(spec, surroundings, [arm.skeleton for arm in wearer.arms] if wearer else [])
    model = spec.compile()
    # MuJoCo would otherwise reset a diverged world to its initial state and continue.
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    if model.opt.jacobian != mujoco.mjtJacobian.mjJAC_DENSE:
        raise RigError(
            "MuJoCo did not keep the dense Jacobian; its sparse solver has a wrong Hessian in some releases."
        )
    data, scratch = mujoco.MjData(model), mujoco.MjData(model)
    exo = np.array([dof(model, joint) for joint in description.joints])
    arms = tuple(find_arm(model, arm) for arm in wearer.arms) if wearer else ()
    fastened = description.donning_posture, _arm_donning_posture(description, wearer)
    return Scene(
        model, data, scratch, exo, arms,
        cuffs=_fasten_cuffs(description, data, exo, arms, fastened, _led(wearer, fastened[1])) if wearer else (),
        fastened=fastened,
        moves_alike=_moves_alike(description, wearer),
        mounts=_mounts(description, model, arms),
    )  # fmt: skip


def _shoulder_centres(spec: mujoco.MjSpec, description: RigDescription) -> dict[str, Float[np.ndarray, " 3"]]:
    """Shoulder centres of the machine, by side [m]."""
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return {side: data.body(description.shoulder_centre(side)).xpos.copy() for side in description.arm_sides}


def _arm_donning_posture(description: RigDescription, wearer: Wearer | None) -> Float[np.ndarray, " arm"]:
    """Donning posture of the arms in their own joints [rad]."""
    if wearer is None:
        return np.empty(0)
    asked = np.split(description.arm_donning_posture, len(wearer.arms))
    return np.concatenate([lying_like(arm.skeleton, q) for arm, q in zip(wearer.arms, asked, strict=True)])


def _led(wearer: Wearer, q_arm: Float[np.ndarray, " arm"]) -> Float[np.ndarray, " follower"]:
    """Positions of all joints that follow the arms, at a posture [m, rad]."""
    return np.asarray(ca.DM(ca.evalf(follower_paths(wearer, ca.SX(ca.DM(q_arm)))))).ravel()


def _moves_alike(description: RigDescription, wearer: Wearer | None) -> bool:
    if wearer is None or description.settings.donning.arm_posture_deg is not None:
        return False
    return all(arm.skeleton.is_straight for arm in wearer.arms)


def _fasten_cuffs(
    description: RigDescription,
    data: mujoco.MjData,
    exo: Int[np.ndarray, " joint"],
    arms: tuple[ArmPlace, ...],
    fastened: tuple[Float[np.ndarray, " joint"], Float[np.ndarray, " arm"]],
    followers: Float[np.ndarray, " follower"],
) -> tuple[CuffPlace, ...]:
    data.qpos[exo] = fastened[0]
    data.qpos[np.concatenate([arm.freedoms for arm in arms])] = fastened[1]
    data.qpos[[i for arm in arms for i in arm.followers]] = followers
    mujoco.mj_kinematics(data.model, data)
    places = []
    for cuff in description.settings.cuffs:
        skeleton = next(arm.skeleton for arm in arms if cuff.side in (None, arm.skeleton.side))
        on_exo, on_arm = data.body(cuff.exo_frame), data.body(body_name(skeleton, skeleton.held[cuff.segment]))
        R_world_arm = on_arm.xmat.reshape(3, 3)
        p_arm = R_world_arm.T @ (on_exo.xpos - on_arm.xpos)
        R_arm = R_world_arm.T @ on_exo.xmat.reshape(3, 3)
        p_exo = data.model.body_pos[on_exo.id].copy()
        holds = (cuff.stiffness > 0.0).astype(float)
        places.append(CuffPlace(cuff.name, on_exo.id, p_exo, on_arm.id, p_arm, R_arm, holds))
    return tuple(places)


def _mounts(description: RigDescription, model: mujoco.MjModel, arms: tuple[ArmPlace, ...]) -> dict[str, int]:
    own = description.mounts
    bodies = dict(zip(("calibration",), own, strict=False)) | {mount: mount for mount in own}
    for where in ("hand", "forearm"):
        sided = [f"{arm.skeleton.side}_{where}" for arm in arms]
        bodies |= ({where: sided[0]} if sided else {}) | {place: place for place in sided}
    return {name: model.body(weight_body(mount)).id for name, mount in bodies.items()}
