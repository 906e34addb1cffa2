"""Schema of `calibration.toml`: the result of stage 0 in readable numbers with units."""

from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import AwareDatetime, Field, NonNegativeFloat, PositiveFloat

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.friction import Friction
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.calibration.empty_machine import V_REST, Calibration, tilted_gravity
from exograv.model.rig_settings import Settings
from exograv.options import Side

from .sealed_file import Sealed, sealed

SCHEMA_VERSION = 1
DIGITS = 7
"""Significant digits of the stored numbers [-]."""
FRICTION = {
    "coulomb": "coulomb{}_Nm",
    "viscous": "viscous{}_Nms_per_rad",
    "breakaway": "breakaway{}",
    "load_share": "load_share{}",
    "asymmetry": "asymmetry{}_Nm",
    "v_stribeck": "v_stribeck{}_rad_per_s",
}
"""Keys of the friction parameters in the file; `{}` becomes "_sd" for standard deviations."""

Ten = Annotated[list[float], Field(min_length=10, max_length=10)]
Two = Annotated[list[float], Field(min_length=2, max_length=2)]


class Identity(Settings):
    """Identity of the calibrated machine."""

    rig: str
    side: Side
    machine: str
    """Serial number; for the twin, its level and seed."""
    rig_sha256: str
    """Hash of `rig.toml` and URDF."""


class MeasurementConditions(Settings):
    """Time and conditions of the measurement."""

    at_utc: AwareDatetime
    friction_at_utc: AwareDatetime
    """Time of the friction; later than `at_utc` after a re-check."""
    running_s: NonNegativeFloat
    """Time since the machine was switched on."""
    lengths_m: dict[str, PositiveFloat]
    """Lengths to which the machine was set, by segment."""


class Base(Settings):
    """Tilt of the base against gravity, about x and y of the base."""

    tilt_deg: Two
    tilt_sd_deg: Two


class JointRow(Settings):
    """Joint with its link; each value with its standard deviation."""

    joint: str
    gain_Nm_per_A: PositiveFloat
    gain_sd_Nm_per_A: NonNegativeFloat
    coulomb_Nm: float
    coulomb_sd_Nm: NonNegativeFloat
    viscous_Nms_per_rad: float
    viscous_sd_Nms_per_rad: NonNegativeFloat
    breakaway: Annotated[float, Field(ge=1.0)]
    """Friction at rest divided by friction in motion."""
    breakaway_sd: NonNegativeFloat
    load_share: NonNegativeFloat
    load_share_sd: NonNegativeFloat
    asymmetry_Nm: float
    asymmetry_sd_Nm: NonNegativeFloat
    v_stribeck_rad_per_s: PositiveFloat
    v_stribeck_sd_rad_per_s: NonNegativeFloat
    rotor_inertia_kgm2: float
    encoder_offset_deg: float
    """Measured minus true; reported and not corrected, because tilt and links absorb its visible part."""
    encoder_offset_sd_deg: NonNegativeFloat
    residual_sd_Nm: NonNegativeFloat
    residual_correlation_s: NonNegativeFloat
    link: Ten
    """Inertial parameters: m [kg], m·c x y z [kg·m], Ixx, Ixy, Iyy, Ixz, Iyz, Izz about the joint [kg·m²]."""
    link_sd: Ten


class StoredCalibration(Sealed):
    """Content of the file `calibration.toml`."""

    VERSION: ClassVar[int] = SCHEMA_VERSION
    schema_version: Literal[1]
    identity: Identity
    measured: MeasurementConditions
    base: Base
    joints: Annotated[list[JointRow], Field(min_length=1)]

    def calibration(self) -> Calibration:
        """Return the calibration in the form that sessions use."""

        def column(name: str) -> np.ndarray:
            return np.array([getattr(row, name) for row in self.joints])

        friction, friction_sd = (
            Friction(**{name: column(key.format(sd)) for name, key in FRICTION.items()}, v_rest=V_REST)
            for sd in ("", "_sd")
        )
        tilt = np.sin(np.deg2rad(self.base.tilt_deg))
        machine = CalibratedMachine(
            actuators=ActuatorGain(column("gain_Nm_per_A"), column("gain_sd_Nm_per_A")),
            friction=friction,
            friction_sd=friction_sd,
            phi=column("link"),
            gravity=tilted_gravity(tilt),
            rotor_inertia=column("rotor_inertia_kgm2"),
            residual_sd=column("residual_sd_Nm"),
            correlation_s=column("residual_correlation_s"),
        )
        offset, offset_sd = np.deg2rad(column("encoder_offset_deg")), np.deg2rad(column("encoder_offset_sd_deg"))
        return Calibration(machine, tilt, np.deg2rad(self.base.tilt_sd_deg), offset, offset_sd, column("link_sd"))


def stored(
    calibration: Calibration, identity: Identity, measured: MeasurementConditions, joints: tuple[str, ...]
) -> StoredCalibration:
    """Return a calibration in the form of the file."""
    machine = calibration.machine
    friction = {key.format(""): getattr(machine.friction, name) for name, key in FRICTION.items()}
    friction |= {key.format("_sd"): getattr(machine.friction_sd, name) for name, key in FRICTION.items()}
    columns = friction | {
        "gain_Nm_per_A": machine.actuators.gain,
        "gain_sd_Nm_per_A": machine.actuators.gain_sd,
        "rotor_inertia_kgm2": machine.rotor_inertia,
        "encoder_offset_deg": np.rad2deg(calibration.offset),
        "encoder_offset_sd_deg": np.rad2deg(calibration.offset_sd),
        "residual_sd_Nm": machine.residual_sd,
        "residual_correlation_s": machine.correlation_s,
        "link": machine.phi,
        "link_sd": calibration.phi_sd,
    }
    rows = [
        JointRow.model_validate({"joint": joint} | {name: _short(column[j]) for name, column in columns.items()})
        for j, joint in enumerate(joints)
    ]
    tilt = np.rad2deg(np.arcsin(calibration.tilt)), np.rad2deg(calibration.tilt_sd)
    base = Base(tilt_deg=_short(tilt[0]), tilt_sd_deg=_short(tilt[1]))
    whole = StoredCalibration(
        schema_version=SCHEMA_VERSION, identity=identity, measured=measured, base=base, joints=rows
    )
    return sealed(whole)


def _short(value: Any) -> Any:
    """Return numbers rounded to the digits that are stored."""
    shortened = [float(f"{number:.{DIGITS}g}") for number in np.ravel(value)]
    return shortened if np.ndim(value) else shortened[0]
