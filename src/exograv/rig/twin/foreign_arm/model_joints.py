"""Joints of a third party's model: freedoms of the arm, coupled joints, and their positions as the arm hangs."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import mujoco
import numpy as np
from jaxtyping import Float
from numpy.polynomial import Polynomial

from exograv.errors import ModelError
from exograv.model.limb import FREEDOMS
from exograv.rig.twin.wearer.skeleton import Coupling

from .wearer_map import WearerMap

NAMES_SHOWN = 60
HINGE, SLIDE, BALL = (
    int(mujoco.mjtJoint.mjJNT_HINGE),
    int(mujoco.mjtJoint.mjJNT_SLIDE),
    int(mujoco.mjtJoint.mjJNT_BALL),
)


@dataclass
class HangingPosture:
    """Positions of the model's joints while its arm hangs straight, and which of them move."""

    qpos: Float[np.ndarray, " qpos"]
    """Positions in the model's own order [rad, m]."""

    freedoms: dict[int, str] = field(default_factory=dict)
    """Freedoms of the arm, by number of the joint."""

    signs: dict[int, int] = field(default_factory=dict)
    """Signs of these joints, by number."""

    ball: tuple[int, ...] = ()
    """Joints that flexion, abduction and rotation replace."""

    coupled: dict[int, Coupling] = field(default_factory=dict)
    locked: set[int] = field(default_factory=set)
    notes: list[str] = field(default_factory=list)

    @property
    def moving(self) -> set[int]:
        """Numbers of all joints that move."""
        return {*self.freedoms, *self.ball, *self.coupled}


def hanging(model: mujoco.MjModel, told: WearerMap) -> HangingPosture:
    """Apply the map to the model's joints, and add the model's own couplings.

    Raises:
        ModelError: A joint does not exist, or cannot have the role that the map gives it.
    """
    stand = HangingPosture(model.qpos0.copy())
    for freedom, mapped in told.freedoms.items():
        joint = _single_joint(model, mapped.joint, f"freedoms.{freedom}", HINGE)
        _set(model, stand, joint, np.deg2rad(mapped.zero_deg), f"freedoms.{freedom}")
        stand.freedoms[joint], stand.signs[joint] = freedom, mapped.sign
    for name, value in told.locked.items():
        joint = find_joint(model, name, "locked")
        if model.jnt_type[joint] in (HINGE, SLIDE):
            _set(model, stand, joint, value if model.jnt_type[joint] == SLIDE else np.deg2rad(value), "locked")
        stand.locked.add(joint)
    _put_ball(model, told, stand)
    for name, follower in told.coupled.items():
        joint = _single_joint(model, name, "coupled", HINGE, SLIDE)
        if follower.freedom not in (*told.freedoms, *(FREEDOMS[:3] if told.shoulder else ())):
            raise ModelError(
                f"coupled.{name} follows {follower.freedom}, but no joint is mapped to it. Map one, or lock {name}."
            )
        _set(model, stand, joint, follower.polynomial[0], "coupled")
        stand.coupled[joint] = Coupling(name, follower.freedom, _five([0.0, *follower.polynomial[1:]]))
    _follow_own_couplings(model, stand)
    return stand


def find_joint(model: mujoco.MjModel, name: str, where: str) -> int:
    """Return the number of a joint.

    Raises:
        ModelError: The joint does not exist.
    """
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name)
    if number < 0:
        raise ModelError(f"{where}: no joint '{name}' in the model. Joints there: {listed(joint_names(model))}.")
    return number


def find_body(model: mujoco.MjModel, name: str, where: str) -> int:
    """Return the number of a body.

    Raises:
        ModelError: The body does not exist.
    """
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    if number < 0:
        names = [model.body(i).name for i in range(1, model.nbody)]
        raise ModelError(f"{where}: no body '{name}' in the model. Bodies there: {listed(names)}.")
    return number


def joint_names(model: mujoco.MjModel) -> list[str]:
    """Names of all joints; a joint without a name is described by its body."""
    return [model.joint(i).name or f"(no name, of {model.body(model.jnt_bodyid[i]).name})" for i in range(model.njnt)]


def listed(names: Sequence[str]) -> str:
    """Return the first names as one text, with the number of the others."""
    rest = len(names) - NAMES_SHOWN
    return ", ".join(names[:NAMES_SHOWN]) + (f" and {rest} more" if rest > 0 else "")


def _single_joint(model: mujoco.MjModel, name: str, where: str, *kinds: int) -> int:
    joint = find_joint(model, name, where)
    if model.jnt_type[joint] not in kinds:
        raise ModelError(
            f"{where}: joint '{name}' turns about more than one axis or slides. Give a hinge; a shoulder that is a "
            "ball goes under [shoulder]."
        )
    return joint


def _set(model: mujoco.MjModel, stand: HangingPosture, joint: int, value: float, where: str) -> None:
    if joint in stand.moving or joint in stand.locked:
        raise ModelError(f"{where}: joint '{model.joint(joint).name}' is named twice in the map. Keep one of them.")
    stand.qpos[model.jnt_qposadr[joint]] = value


def _put_ball(model: mujoco.MjModel, told: WearerMap, stand: HangingPosture) -> None:
    if told.shoulder is None:
        return
    joints = [find_joint(model, name, "shoulder.joints") for name in told.shoulder.joints]
    kinds = [int(model.jnt_type[joint]) for joint in joints]
    if not (kinds == [BALL] or all(kind == HINGE for kind in kinds)):
        raise ModelError(
            f"shoulder.joints are {', '.join(told.shoulder.joints)}: give one ball joint, or one to three hinges."
        )
    zeros = np.deg2rad(told.shoulder.zero_deg or [0.0] * len(joints))
    for joint, zero in zip(joints, zeros, strict=False):
        if model.jnt_type[joint] == HINGE:
            _set(model, stand, joint, float(zero), "shoulder.joints")
    stand.ball = tuple(joints)
    stand.notes.append(f"Three hinges about one centre replace {', '.join(told.shoulder.joints)}.")


def _follow_own_couplings(model: mujoco.MjModel, stand: HangingPosture) -> None:
    """Apply the model's own constraints between joints: follow a freedom, or stay where the leading joint is."""
    for k in range(model.neq):
        led, leader = int(model.eq_obj1id[k]), int(model.eq_obj2id[k])
        if led in stand.moving or led in stand.locked:
            continue
        own = Polynomial(model.eq_data[k, :5]) + model.qpos0[model.jnt_qposadr[led]]
        name = model.joint(led).name
        if leader in stand.freedoms:
            lead = stand.qpos[model.jnt_qposadr[leader]] - model.qpos0[model.jnt_qposadr[leader]]
            path = own(Polynomial([lead, stand.signs[leader]]))
            stand.qpos[model.jnt_qposadr[led]] = path.coef[0]
            stand.coupled[led] = Coupling(name, stand.freedoms[leader], _five([0.0, *path.coef[1:]]))
            continue
        lead = 0.0
        if leader >= 0:
            at = model.jnt_qposadr[leader]
            lead = stand.qpos[at] - model.qpos0[at]
        stand.qpos[model.jnt_qposadr[led]] = own(lead)
        stand.locked.add(led)
        if leader in stand.ball:
            stand.notes.append(f"{name} stays as in the hanging arm: it follows one of the shoulder's joints.")


def _five(coefficients: Sequence[float]) -> Float[np.ndarray, " 5"]:
    return np.array([*coefficients, *[0.0] * 5][:5], dtype=float)
