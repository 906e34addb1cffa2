"""Loads of joints by known weights in their sweeps: each joint needs one for its gain, and has to carry it."""

from dataclasses import dataclass

import casadi as ca
import numpy as np
from jaxtyping import Float

from exograv.dynamics.at_rest import carrying_torque
from exograv.dynamics.loop_torque import GRAVITY
from exograv.errors import ConfigError
from exograv.identification.calibration.empty_prior import COULOMB, usual_friction
from exograv.identification.excitation.limits import TORQUE_SHARE
from exograv.model.description import RigDescription
from exograv.model.kinematics import body_poses, frame_pose
from exograv.model.rig_settings import JointSweep
from exograv.model.tree import Tree

LOADED_NM = 0.1
"""Torque of the lightest weight below which scatter of the friction hides it [N·m]."""

CARRIED_SHARE = TORQUE_SHARE
"""Share of the motors' largest torque for links, friction and a known weight, as for a designed motion [-]. Motors that
give more during a sweep become hot, and their drives then give less."""

LEAST_KG = 0.1
"""Known weight below which no advice for a lighter one is given [kg]."""

VERTICAL = 0.02
"""Sine of the angle to the vertical below which an axis counts as vertical [-]."""

PLACES = 25


@dataclass(frozen=True)
class WeightLoad:
    """Load of a joint by the lightest known weight in its sweep."""

    mount: str
    """Frame at which the weight hangs."""

    tau: float
    """Largest torque [N·m]."""

    is_vertical: bool
    """True if the axis stays vertical, so that no weight loads it."""


def weight_load(description: RigDescription, tree: Tree, sweep: JointSweep) -> WeightLoad:
    """Return the load of a joint by the lightest known weight in its sweep."""
    moving = description.joints.index(sweep.joint)
    postures, mount = _postures(description, sweep), _mount(description, sweep)
    torques = min(description.calibration.weights_kg) * _torque_per_kg(tree, mount, postures)
    q = ca.SX.sym("q", len(tree.joints))  # pyright: ignore[reportArgumentType]
    axis = body_poses(tree, q)[moving].R @ ca.DM(tree.joints[moving].axis)
    tilt = ca.Function("tilt", [q], [ca.norm_2(axis[:2])])
    tilts = np.array(tilt(postures.T))
    return WeightLoad(mount, float(np.abs(torques[:, moving]).max()), bool(tilts.max() < VERTICAL))


@dataclass(frozen=True)
class CarriedWeight:
    """Heaviest weight that the motors carry in a sweep."""

    mount: str
    """Frame at which the weight hangs."""

    kg: float
    """The weight, by the links of the URDF and usual friction; 0 if the motors do not carry the links [kg]."""

    joint: str
    """Joint whose motor carries no more."""

    torque_max_Nm: float
    """Largest torque of that motor."""


def carried_weight(description: RigDescription, tree: Tree, sweep: JointSweep) -> CarriedWeight:
    """Return the heaviest weight that the motors carry in a sweep."""
    postures, mount = _postures(description, sweep), _mount(description, sweep)
    per_kg = _torque_per_kg(tree, mount, postures)
    links = carrying_torque(tree, postures)
    torque_max = description.per_actuator("torque_max_Nm")
    room = CARRIED_SHARE * torque_max - usual_friction(description, COULOMB)[0] - np.sign(per_kg) * links
    # A joint without a motor carries nothing, and has no torque in `rig.toml`.
    is_loaded = (np.abs(per_kg) > 1e-9) & np.isfinite(room)
    limits = np.divide(room, np.abs(per_kg), out=np.full(room.shape, np.inf), where=is_loaded)
    joint = int(np.argmin(limits.min(axis=0)))
    return CarriedWeight(mount, max(float(limits.min()), 0.0), description.joints[joint], float(torque_max[joint]))


def carrying_share(description: RigDescription, tree: Tree) -> Float[np.ndarray, " joint"]:
    """Share of the motors' largest torque for links, friction and the lightest known weight in all sweeps [-].

    By the links of the URDF and usual friction; 0 for a joint without a motor.
    """
    kg, most = min(description.calibration.weights_kg), np.zeros(len(description.joints))
    for sweep in description.settings.sweeps:
        postures = _postures(description, sweep)
        links = np.array([carrying_torque(tree, q) for q in postures])
        carried = links + kg * _torque_per_kg(tree, _mount(description, sweep), postures)
        most = np.maximum(most, np.maximum(np.abs(links), np.abs(carried)).max(axis=0))
    share = (most + usual_friction(description, COULOMB)[0]) / description.per_actuator("torque_max_Nm")
    return np.nan_to_num(share)


def weights_not_carried(description: RigDescription, tree: Tree) -> list[str]:
    """Return a sentence for each sweep in which the motors do not carry the heaviest known weight."""
    told = list[str]()
    for sweep in description.settings.sweeps:  # none without a calibration
        heaviest, carried = max(description.calibration.weights_kg), carried_weight(description, tree, sweep)
        if heaviest <= carried.kg:
            continue
        if carried.kg < LEAST_KG:
            advice = (
                f"Give '{carried.joint}' a stronger motor, or another posture_deg in that sweep, closer to hanging."
            )
        else:
            advice = (
                f"Set calibration.weights_kg in rig.toml to lighter weights, such as {_lighter(carried.kg)}, or "
                "change posture_deg of that sweep so that the lever is shorter."
            )
        told.append(
            f"In the sweep of '{sweep.joint}' the motor of '{carried.joint}' ({carried.torque_max_Nm:g} N·m) carries "
            f"at most {carried.kg:.2g} kg at '{carried.mount}'; the heaviest known weight has {heaviest:g} kg. "
            f"{advice}"
        )
    return told


def refuse_heavy_weights(description: RigDescription, tree: Tree) -> None:
    """Refuse known weights that the motors do not carry.

    Raises:
        ConfigError: A weight is too heavy; the message states the heaviest that is carried.
    """
    told = weights_not_carried(description, tree)
    if told:
        raise ConfigError(" ".join(told))


def _lighter(kg: float) -> list[float]:
    """Return two weights that a machine carries which carries `kg`."""
    most = np.floor(10.0 * kg) / 10.0
    return [round(0.5 * float(most), 2), round(float(most), 2)]


def _mount(description: RigDescription, sweep: JointSweep) -> str:
    return sweep.mount or description.calibration.mount


def _postures(description: RigDescription, sweep: JointSweep) -> Float[np.ndarray, "posture joint"]:
    moving = description.joints.index(sweep.joint)
    postures = np.tile(np.deg2rad(sweep.posture_deg), (PLACES, 1))
    postures[:, moving] = np.deg2rad(np.linspace(sweep.from_deg, sweep.to_deg, PLACES))
    return postures


def _torque_per_kg(
    tree: Tree, mount: str, postures: Float[np.ndarray, "posture joint"]
) -> Float[np.ndarray, "posture joint"]:
    """Torque that carries one kilogram at a mount [N·m/kg]."""
    q = ca.SX.sym("q", len(tree.joints))  # pyright: ignore[reportArgumentType]
    height = frame_pose(tree, body_poses(tree, q), mount).p[2]
    found = ca.Function("per_kg", [q], [-GRAVITY[2] * ca.gradient(height, q)])
    return np.array(found(postures.T)).T
