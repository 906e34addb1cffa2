"""Plausibility checks of the first pushes of a calibration. Feedback is closed over a joint only after them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.errors import ConfigError, IdentificationError
from exograv.identification.calibration.empty_checks import OFFSET_MAX
from exograv.identification.calibration.empty_prior import COULOMB, usual_friction
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.rig import Rig

PEAK_CURRENT_A = (0.2, 500.0)
"""Plausible current of a joint's motor at its largest torque. Motors of exoskeletons take 1-50 A; a constant in mN·m/A,
or a current in mA, is wrong by a factor of 1000."""
BEYOND_LIMITS = np.deg2rad(15.0)  # hard stops lie up to 5° beyond the URDF's limits, an encoder may be off by 3°
MOVED = 0.02
"""Displacement that ends a push: 400 steps of a good encoder, 20 of a bad one [rad]."""
CURRENT_TICKS = 100  # over which commanded and measured current are compared
CURRENT_SHARE = 0.5  # allowed difference as a share of the command,
CURRENT_OFFSET = 0.5  # plus this share of the usual Coulomb friction
V_PUSHED = 1.5  # rad/s: a push that grows slowly moves a joint at 0.2-1
TOO_LIGHT = 0.1  # share of the usual Coulomb friction below which a measured one is not credible

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class PushSamples:
    """Samples of one push, with position and current filtered alike."""

    t: Float[np.ndarray, " tick"]
    """Time [s]."""
    q: Float[np.ndarray, "tick joint"]
    """Joint position [rad]."""
    current: Float[np.ndarray, "tick joint"]
    """Measured motor current [A]."""
    commanded: Float[np.ndarray, "tick joint"]
    """Commanded motor current [A]."""
    way: Joints
    """Displacement from rest to the end of the push, not filtered [rad]."""


def refuse_joints_without_motor(description: RigDescription) -> None:
    """Refuse a machine with a motorless joint: a calibration moves every joint by its own motor.

    Raises:
        ConfigError: A joint has no motor.
    """
    if description.motorless:
        raise ConfigError(
            f"{description.name} has no motor at {', '.join(description.motorless)}: a calibration moves every joint "
            "by its own motor. Use a machine with a motor at each joint."
        )


def refuse_before_motion(description: RigDescription, tree: Tree, rig: Rig) -> None:
    """Check joints, drives and encoder readings before the first current flows.

    Raises:
        ConfigError: Joints, drives or encoder readings do not fit `rig.toml` and URDF.
    """
    refuse_joints_without_motor(description)
    if tuple(rig.joints) != description.joints:
        raise ConfigError(
            f"The rig's joints are {', '.join(rig.joints)}; rig.toml has {', '.join(description.joints)}. "
            "They must be the same, in the same order: correct the driver's list or rig.toml."
        )
    torque_max = description.per_actuator("torque_max_Nm")
    for joint, peak in zip(description.joints, torque_max / description.nominal_gain, strict=True):
        if not PEAK_CURRENT_A[0] <= peak <= PEAK_CURRENT_A[1]:
            raise ConfigError(
                f"Joint '{joint}' would need {peak:.3g} A for its largest torque; {PEAK_CURRENT_A[0]:g} to "
                f"{PEAK_CURRENT_A[1]:g} A are plausible. Correct torque_constant_Nm_per_A (not mN·m/A), gear_ratio, "
                "efficiency or torque_max_Nm in rig.toml."
            )
    for joint, q in zip(tree.joints, rig.read().q, strict=True):
        if not joint.lower - BEYOND_LIMITS <= q <= joint.upper + BEYOND_LIMITS:
            raise ConfigError(
                f"The encoder of joint '{joint.name}' reads {q:.2f} rad ({np.rad2deg(q):.0f}°); the joint turns from "
                f"{joint.lower:.2f} to {joint.upper:.2f} rad. It may count in degrees, or from another zero. Correct "
                "the encoder's unit, sign or zero in the driver."
            )


def refuse_not_hanging(
    description: RigDescription,
    hanging: Joints,
    q: Joints,
    weight: Joints,
    stiffness: Float[np.ndarray, "joint joint"],
) -> None:
    """Refuse a posture `q` [rad] in which the torque by the machine's `weight` (joint,) [N·m] exceeds friction.

    Encoders may be off by `OFFSET_MAX`. In a heavy machine such an offset looks like more torque than light friction
    holds: `stiffness` is the derivative of the weight's torque by the posture [N·m/rad].

    Raises:
        ConfigError: Friction could not hold the machine there, so the readings are wrong.
    """
    off = OFFSET_MAX * np.abs(stiffness).sum(axis=1)
    for joint, (name, usual) in enumerate(
        zip(description.joints, usual_friction(description, COULOMB)[0], strict=True)
    ):
        if abs(weight[joint]) > usual + off[joint]:
            raise ConfigError(
                f"By its encoders the machine's weight gives {weight[joint]:+.1f} N·m at joint '{name}', which reads "
                f"{np.rad2deg(q[joint]):.1f}° (hanging by the URDF: {np.rad2deg(hanging[joint]):.0f}°). Friction "
                f"holds {usual:g} N·m, and an encoder that is off by {np.rad2deg(OFFSET_MAX):.0f}° explains "
                f"{off[joint]:.1f} N·m more. Let the machine hang, empty, before it is calibrated. If it hangs, this "
                "encoder is reversed, has another zero, or is swapped with another."
            )


def check_push(description: RigDescription, joint: int, sign: float, pushed: PushSamples) -> None:
    """Check that a push moved the pushed joint, along the push, by the commanded current.

    Raises:
        IdentificationError: A check failed.
    """
    name, gain = description.joints[joint], float(description.nominal_gain[joint])
    usual = float(usual_friction(description, COULOMB)[0][joint])
    _refuse_other_current(name, gain, usual, pushed.commanded[:, joint], pushed.current[:, joint])
    tau = gain * float(pushed.commanded[-1, joint])
    moved = int(np.abs(pushed.way).argmax())
    way = sign * float(pushed.way[joint])
    if abs(pushed.way[moved]) < MOVED:
        raise IdentificationError(
            f"Joint '{name}' did not move under {abs(tau):.1f} N·m ({abs(tau) / gain:.2f} A); friction of such a "
            f"drive is about {usual:g} N·m. It may be blocked or braked, its motor disconnected, or "
            "torque_constant_Nm_per_A in rig.toml 1000 times too large. Free it, or correct that."
        )
    if moved != joint:
        raise IdentificationError(
            f"Pushing joint '{name}' with {tau:.1f} N·m moved '{description.joints[moved]}' by "
            f"{np.rad2deg(pushed.way[moved]):.1f}° and '{name}' by {np.rad2deg(pushed.way[joint]):.1f}°. Motors or "
            "encoders of the two are swapped: correct their order in the driver."
        )
    if way < 0.0:
        raise IdentificationError(
            f"Joint '{name}' moved by {np.rad2deg(sign * way):.1f}° under {tau:+.1f} N·m; it must move along the "
            "torque. Its encoder or its motor counts the other way round than the URDF's axis: flip the sign of the "
            "encoder if it shows the wrong direction by eye, else of the motor."
        )


def refuse_shot(description: RigDescription, joint: int, speed: float) -> None:
    """Refuse a joint whose `speed` [rad/s] under a slowly growing push is too high.

    Raises:
        IdentificationError: The speed exceeds `V_PUSHED`.
    """
    if speed > V_PUSHED:
        raise IdentificationError(
            f"Joint '{description.joints[joint]}' shot off at {speed:.1f} rad/s when it was pushed; {V_PUSHED:g} "
            "rad/s are allowed. Its motor gives far more torque than commanded: correct torque_constant_Nm_per_A in "
            "rig.toml, or the unit of the current in the driver (mA for A)."
        )


def refuse_too_light(description: RigDescription, joint: int, upwards: Sequence[float], down: Sequence[float]) -> None:
    """Refuse a joint with almost no friction: half the difference of the torques that moved it both ways [N·m].

    Raises:
        IdentificationError: The friction is too small to be credible.
    """
    name, usual = description.joints[joint], float(usual_friction(description, COULOMB)[0][joint])
    friction = 0.5 * (float(np.mean(upwards)) + float(np.mean(down)))
    if friction < TOO_LIGHT * usual:
        raise IdentificationError(
            f"By rig.toml, {friction:.2g} N·m of friction hold joint '{name}'; such a drive has about {usual:g} N·m, "
            f"and {TOO_LIGHT * usual:.2g} N·m is the smallest credible value. torque_constant_Nm_per_A is too "
            "small in rig.toml, or the drive takes mA for A: correct the unit."
        )


def _refuse_other_current(
    name: str, gain: float, usual: float, commanded: Float[np.ndarray, " tick"], measured: Float[np.ndarray, " tick"]
) -> None:
    asked, flowed = float(commanded[-CURRENT_TICKS:].mean()), float(measured[-CURRENT_TICKS:].mean())
    if abs(flowed - asked) <= CURRENT_SHARE * abs(asked) + CURRENT_OFFSET * usual / gain:
        return
    raise IdentificationError(
        f"Joint '{name}' was commanded {asked:.3g} A and measures {flowed:.3g} A; they may differ by "
        f"{CURRENT_SHARE:.0%}. If no current flows, its motor is disconnected. Otherwise correct the unit (mA for A) "
        "or the sign of the current in the driver."
    )


def refuse_spring(description: RigDescription, joint: int, stayed: Mapping[float, Sequence[float]]) -> None:
    """Refuse a joint that springs back: friction must hold it where it was pushed, `stayed` [rad] along the push.

    `stayed` holds displacements by direction of the push. The weight of a light joint may bring it back in one
    direction; a spring brings it back in both.

    Raises:
        IdentificationError: The joint came back in both directions.
    """
    by_way = [float(np.mean(one_way)) for one_way in stayed.values()]
    if by_way and max(by_way) < MOVED / 2:
        raise IdentificationError(
            f"Joint '{description.joints[joint]}' was pushed by {np.rad2deg(MOVED):.2f}° and came back to "
            f"{np.rad2deg(max(by_way)):.2f}°, both ways; its friction must hold it. Either it is blocked and bends, or "
            "its encoder counts in degrees where radians are expected. Free it, or correct the encoder's unit in the "
            "driver."
        )


def refuse_restless(description: RigDescription, v: Joints) -> None:
    """Raise an error: the machine moves at `v` [rad/s] without a push.

    Raises:
        IdentificationError: Always.
    """
    joint = int(np.abs(v).argmax())
    raise IdentificationError(
        f"Joint '{description.joints[joint]}' moves at {np.rad2deg(v[joint]):.1f}°/s while nothing pushes it. Let the "
        "machine hang still before it is calibrated, without a person in it or a weight on it."
    )
