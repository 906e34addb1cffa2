"""Comparison of a moteus's settings with `drives.toml` and with the needs of its torques, before it is on."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from moteus import Register

from exograv.errors import ConfigError, RigError
from exograv.rig.drives.nameplate import refuse_other_value
from exograv.rig.drives.settings import Drive, Drives

from .diagnostic import Diagnostic

BRAKE_MODE, LETS_GO_MODE, ON_OUTPUT = 15, 0, 2
OLDEST_FIRMWARE, OLDEST_MAP = 0x010A, 5
"""Oldest firmware and register map that exograv supports.

From these on, motor.Kv has the meaning that `torque_per_ampere` assumes, and the registers are those of
docs/howto/moteus.md.
"""

SAME_BRAKE = 0.25
"""Relative tolerance of the brake: the resistance of copper rises by so much over 60 K."""

KV_Nm_PER_A = 1.5 / math.sqrt(3.0) * 60.0 / (2.0 * math.pi)
"""Torque constant of a motor times its Kv, in the firmware's definition. Source: mjbots moteus, fw/bldc_servo.cc."""


@dataclass(frozen=True)
class RequiredSetting:
    """Setting with a required value."""

    name: str
    holds: Callable[[float], bool]
    needed: str
    why: str
    may_be_missing: bool = False
    """True if older firmware lacks the setting and the function behind it."""


MUSTS = (
    RequiredSetting("motor.Kv", lambda x: x > 0.0, "measured", "its torques rest on it: run moteus_tool --calibrate"),
    RequiredSetting(
        "motor.resistance_ohm", lambda x: x > 0.0, "measured", "its brake rests on it: run moteus_tool --calibrate"
    ),
    RequiredSetting(
        "motor_position.rotor_to_output_ratio", lambda x: x > 0.0, "above 0", "positions and torques are the joint's"
    ),
    RequiredSetting(
        "servo.pid_position.kp", lambda x: x == 0.0, "0", "with any other, half a command could make it run to 0"
    ),
    RequiredSetting(
        "servo.pid_position.ki", lambda x: x == 0.0, "0", "with any other, half a command could make it run to 0"
    ),
    RequiredSetting(
        "servo.pid_position.kd", lambda x: x > 0.0, "above 0", "with it the guard brakes a joint that it distrusts"
    ),
    RequiredSetting("servopos.position_min", math.isnan, "nan", "beyond it the drive would reduce torque by itself"),
    RequiredSetting("servopos.position_max", math.isnan, "nan", "beyond it the drive would reduce torque by itself"),
    RequiredSetting("servo.bemf_feedforward", lambda x: x == 0.0, "0", "with it the drive refuses a torque command"),
    RequiredSetting("servo.voltage_mode_control", lambda x: x == 0.0, "0", "with it currents are not controlled"),
    RequiredSetting("servo.fixed_voltage_mode", lambda x: x == 0.0, "0", "with it currents are not controlled"),
    RequiredSetting("servo.fault_position_error", math.isnan, "nan", "a torque command holds no position", True),
    RequiredSetting("servo.fault_velocity_error", math.isnan, "nan", "a torque command holds no speed", True),
)


@dataclass(frozen=True)
class CommandScaling:
    """Scaling of commands to one drive."""

    torque_per_ampere: float
    """Torque at the output per ampere, by which the drive converts torques to currents [N·m/A]."""

    kd: float
    """Damping of the output speed [N·m·s/rad], at `kd_scale` 1."""


def read_plate(asked: Diagnostic, drive: Drive, drives: Drives) -> CommandScaling:
    """Return the scaling of commands, after all settings have been checked.

    Raises:
        RigError: The drive does not answer, or does not know where its output is.
        ConfigError: A setting is not what `drives.toml` or exograv requires. The message names joint, setting and the
            next step.
    """
    asked.flush()
    _refuse_unfit(asked, drive)
    found = {must.name: _held(asked, drive, must) for must in MUSTS}
    of = f" of joint {drive.joint}"
    greatest = _known(asked, drive, "servo.max_current_A")
    refuse_other_value(f"greatest current{of}", greatest, "current_max_A", drive.current_max_A, "A")
    timeout_ms = 1e3 * _known(asked, drive, "servo.default_timeout_s")
    refuse_other_value(f"watchdog{of}", timeout_ms, "watchdog_ms", drives.settings.watchdog_ms, "ms")
    per_ampere = KV_Nm_PER_A / found["motor.Kv"] / found["motor_position.rotor_to_output_ratio"]
    brake = _brake(asked, drive, per_ampere, found["motor.resistance_ohm"])
    unit, stated = "N·m·s/rad", drive.brake_Nms_per_rad
    refuse_other_value(f"brake{of}", brake, "brake_Nms_per_rad", stated, unit, SAME_BRAKE)
    _refuse_bent_torque(asked, drive)
    return CommandScaling(per_ampere, found["servo.pid_position.kd"] / (2.0 * math.pi))


def _refuse_unfit(asked: Diagnostic, drive: Drive) -> None:
    if (version := asked.register(Register.FIRMWARE_VERSION)) < OLDEST_FIRMWARE or (
        asked.register(Register.REGISTER_MAP_VERSION) < OLDEST_MAP
    ):
        raise RigError(
            f"The moteus of {drive.joint} (id {drive.node}) has firmware 0x{version:06x}, whose torque constant has "
            f"another meaning; exograv needs 0x{OLDEST_FIRMWARE:06x} or later. Update it: moteus_tool --flash."
        )
    if asked.register(Register.HOME_STATE, is_short=True) != ON_OUTPUT:
        raise RigError(
            f"The moteus of {drive.joint} (id {drive.node}) does not know where its output is: after power-up it may "
            "be whole turns of the motor away. Give it an encoder on the joint, or set its position "
            "(`d exact`, with the joint held where drives.toml's offset_deg says) before each session."
        )


def _known(asked: Diagnostic, drive: Drive, name: str) -> float:
    value = asked.setting(name)
    if value is None:
        raise RigError(f"The moteus of {drive.joint} (id {drive.node}) has no setting {name}: is it a moteus?")
    return value


def _held(asked: Diagnostic, drive: Drive, must: RequiredSetting) -> float:
    value = asked.setting(must.name) if must.may_be_missing else _known(asked, drive, must.name)
    if value is not None and not must.holds(value):
        raise ConfigError(
            f"{must.name} of joint {drive.joint} (moteus id {drive.node}) is {value:g}; it must be {must.needed}: "
            f"{must.why}. {_set_it(drive)}"
        )
    return math.nan if value is None else value


def _brake(asked: Diagnostic, drive: Drive, per_ampere: float, resistance: float) -> float:
    """Damping with which the drive brakes when commands stop [N·m·s/rad], at slow speed."""
    mode = _known(asked, drive, "servo.timeout_mode")
    if mode == LETS_GO_MODE:
        return 0.0
    if mode != BRAKE_MODE:
        raise ConfigError(
            f"servo.timeout_mode of joint {drive.joint} (moteus id {drive.node}) is {mode:g}; it must be {BRAKE_MODE}: "
            f"when commands stop, only shorted windings brake without the encoder. {_set_it(drive)}"
        )
    return per_ampere**2 / (1.5 * resistance)


def _refuse_bent_torque(asked: Diagnostic, drive: Drive) -> None:
    cutoff = _known(asked, drive, "motor.rotation_current_cutoff_A")
    if cutoff < drive.current_max_A:
        raise ConfigError(
            f"motor.rotation_current_cutoff_A of joint {drive.joint} (moteus id {drive.node}) is {cutoff:g} A; it must "
            f"be at least current_max_A, {drive.current_max_A:g} A: above it a torque is no longer proportional to "
            f"the current that exograv asks for. {_set_it(drive)}"
        )


def _set_it(drive: Drive) -> str:
    return f"Set it with moteus_tool -t {drive.node} --console (conf set, conf write); no motor was switched on."
