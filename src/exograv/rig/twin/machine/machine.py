"""True parameters of one machine: how drives, sensors and links deviate from data sheet and URDF."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.model.description import RigDescription
from exograv.rig.twin.disturbances.levels import ROWS, Disturbances
from exograv.rig.twin.disturbances.streams import stream, uniform

from .foreign_drive import ForeignDrives, draw_foreign_drives

GRAVITY = 9.81
"""Earth's gravity [m/s²]."""

WATCHDOG_DAMPING = {"shoulder": 10.0, "elbow": 4.0, "wrist": 0.4}
"""Braking coefficient of the assembled drives [N·m·s/rad], as in a soft descent of docs/explanation/safety.md."""

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class TrueFriction:
    """Friction of the drives at the joint, on the motor's side of the gear; one entry per joint."""

    coulomb: Joints
    """True Coulomb friction of each joint [N·m]."""

    breakaway: Joints
    """Breakaway friction over Coulomb friction [-]."""

    stribeck_velocity: Joints
    """Speed over which friction falls from breakaway to Coulomb [rad/s]."""

    viscous: Joints
    """True viscous friction of each joint [N·m·s/rad]."""

    load_share: Joints
    """Additional Coulomb friction per torque through the gear [-]."""

    asymmetry: Joints
    """Share by which friction is larger in positive motion and smaller in negative motion [-]."""

    ripple: Joints
    """Amplitude of the friction ripple over one turn of the motor [N·m]."""

    ripple_phase: Joints
    """Phase of the ripple [rad]."""

    warm_up: Joints
    """Share by which Coulomb and viscous friction fall in 30 min [-]."""

    viscous_power: Joints | None = None
    """Power of the speed in viscous friction [-]; None for 1."""


@dataclass(frozen=True)
class TrueDrives:
    """Motors and gears, one entry per joint."""

    gain: Joints
    """Torque at the joint per motor current; zero without a motor [N·m/A]."""

    torque_max: Joints
    """Largest motor torque at the joint [N·m]."""

    gear_ratio: Joints
    rotor_inertia: Joints
    """Rotor inertia, reflected to the joint [kg·m²]."""

    gear_stiffness: Joints
    """Torsional stiffness of the gear; infinite for a rigid gear [N·m/rad]."""

    bandwidth: Joints
    """Bandwidth of the motor torque; infinite for a motor without lag [Hz]."""

    watchdog_damping: Joints
    """Coefficient with which a drive brakes its motor after its watchdog has expired [N·m·s/rad]."""

    gain_slope: Joints | None = None
    """Change of the gain over the gain, per degree of the winding [1/°C]; None for gains that stay."""

    gain_at: Joints | None = None
    """Temperature of the winding at which the gain is `gain` [°C]; None for gains that stay."""


@dataclass(frozen=True)
class TrueSensors:
    """Errors of encoders and current sensors, one entry per joint."""

    current_noise: Joints
    """SD of current noise at 1 kHz, as torque at the joint [N·m]."""

    encoder_step: Joints
    """Quantisation step; zero for a perfect encoder [rad]."""

    encoder_offset: Joints
    """Measured minus true position [rad]."""

    delay: float
    """Dead time of sensor and command together [s]."""

    has_motor_encoders: bool = True
    """True if each motor has an encoder of its own."""


@dataclass(frozen=True)
class TrueCuffSensors:
    """Errors of six-axis force/torque sensors at the cuffs; force [N] before moment [N·m]."""

    gain: Float[np.ndarray, "cuff 6"]
    """Measured over true value [-]."""

    bias: Float[np.ndarray, "cuff 6"]
    """Bias after taring [N, N·m]."""

    noise: Float[np.ndarray, " 6"]
    """SD of the noise at 1 kHz [N, N·m]."""


@dataclass(frozen=True)
class Machine:
    """True parameters of one machine, drawn once and never changed."""

    friction: TrueFriction
    drives: TrueDrives
    sensors: TrueSensors
    cuff_sensors: TrueCuffSensors
    gravity: Float[np.ndarray, " 3"]
    """Gravity in the axes of the tilted base [m/s²]."""

    seed: int
    """Seed of the error of each link, drawn by the link's name in `link_error`."""

    link_mass_sd: float
    link_centre_sd: float
    """SD of the shift of a link's centre of mass per axis [m]."""

    foreign: ForeignDrives | None = None
    """Laws of the drives in a foreign world; None at home."""

    links: Mapping[str, Float[np.ndarray, " 10"]] | None = None
    """Inertial parameters of the body behind each joint, in the order of `model.tree.inertial_parameters`, with all
    bodies that are fixed to it; None if they are those of the URDF with the errors of `link_error`."""

    def link_error(self, link: str) -> tuple[float, Float[np.ndarray, " 3"]]:
        """Factor on the mass of a link [-] and shift of its centre of mass in its frame [m]."""
        drawn = stream(self.seed, "machine", f"link {link}").standard_normal(4)
        # At level 4 a factor below zero is a ten-sigma draw. The lower bound of 0.1 excludes it, because a negative
        # mass must not exist.
        return max(0.1, 1.0 + self.link_mass_sd * drawn[0]), self.link_centre_sd * drawn[1:]


def draw_machine(description: RigDescription, disturbances: Disturbances, seed: int) -> Machine:
    """Draw one machine of the described kind."""
    draw = _Draw(description, disturbances, seed)
    tilt = np.deg2rad(draw.number("base_tilt", "sd_deg")) * stream(seed, "machine", "base_tilt").standard_normal(2)
    return Machine(
        friction=_draw_friction(draw),
        drives=_draw_drives(draw),
        sensors=_draw_sensors(draw),
        cuff_sensors=_draw_cuff_sensors(draw),
        gravity=_tilted_gravity(*tilt),
        seed=seed,
        link_mass_sd=draw.number("links", "mass"),
        link_centre_sd=1e-3 * draw.number("links", "centre_mm"),
        foreign=draw_foreign_drives(seed, len(description.joints)) if disturbances.is_foreign("drives") else None,
    )


@dataclass(frozen=True)
class _Draw:
    """Random draws of one seed, joint by joint."""

    description: RigDescription
    disturbances: Disturbances
    seed: int

    def by_drive(self, row: str) -> Joints:
        """Draw a row whose columns are kinds of drive, or kinds of drive at shoulder, elbow or wrist."""
        columns = ROWS[row].columns
        kinds = [(a.drive, f"{a.drive}.{a.place}") for a in self.description.settings.actuators]
        return self._each(row, [at_place if at_place in columns else drive for drive, at_place in kinds])

    def alike(self, row: str, column: str) -> Joints:
        """Draw a row that is the same for all drives."""
        return self._each(row, [column] * len(self.description.joints))

    def signs(self, row: str) -> Joints:
        """Draw -1 or 1 for each joint."""
        return stream(self.seed, "machine", f"{row} sign").choice([-1.0, 1.0], len(self.description.joints))

    def normal(self, row: str) -> Joints:
        """Draw a standard normal number for each joint."""
        return stream(self.seed, "machine", f"{row} normal").standard_normal(len(self.description.joints))

    def number(self, row: str, column: str) -> float:
        """Draw a row that has one value for the whole machine."""
        return uniform(stream(self.seed, "machine", row), self.disturbances.value(row, column))

    def _each(self, row: str, columns: list[str]) -> Joints:
        generator = stream(self.seed, "machine", row)
        return np.array([uniform(generator, self.disturbances.value(row, column)) for column in columns])


def _draw_friction(draw: _Draw) -> TrueFriction:
    n = len(draw.description.joints)
    return TrueFriction(
        coulomb=draw.by_drive("coulomb"),
        breakaway=draw.alike("breakaway", "ratio"),
        stribeck_velocity=draw.alike("stribeck_velocity", "value"),
        viscous=draw.by_drive("viscous"),
        load_share=draw.by_drive("load_friction"),
        asymmetry=draw.alike("asymmetry", "share") * draw.signs("asymmetry"),
        ripple=draw.by_drive("friction_ripple"),
        ripple_phase=stream(draw.seed, "machine", "ripple phase").uniform(-np.pi, np.pi, n),
        warm_up=draw.alike("warm_up", "share"),
    )


def _draw_drives(draw: _Draw) -> TrueDrives:
    description = draw.description
    return TrueDrives(
        gain=description.nominal_gain * (1.0 + draw.alike("gain_error", "sd") * draw.normal("gain_error")),
        # A joint without a motor has neither torque nor gear.
        torque_max=np.nan_to_num(description.per_actuator("torque_max_Nm"), nan=0.0),
        gear_ratio=np.nan_to_num(description.per_actuator("gear_ratio"), nan=1.0),
        rotor_inertia=draw.by_drive("rotor_inertia"),
        gear_stiffness=1e3 * draw.by_drive("gear_stiffness"),
        bandwidth=draw.by_drive("torque_bandwidth"),
        watchdog_damping=np.array([WATCHDOG_DAMPING[place] for place in description.places]),
    )


def _draw_sensors(draw: _Draw) -> TrueSensors:
    offset_sd = np.deg2rad(draw.alike("encoder", "offset_sd_deg"))
    return TrueSensors(
        current_noise=draw.by_drive("current_noise"),
        encoder_step=2.0 * np.pi * 2.0 ** -draw.alike("encoder", "bits"),
        encoder_offset=offset_sd * draw.normal("encoder"),
        delay=1e-3 * draw.number("delay", "value_ms"),
    )


def _draw_cuff_sensors(draw: _Draw) -> TrueCuffSensors:
    sd = {column: draw.number("cuff_sensors", column) for column in ROWS["cuff_sensors"].columns}
    generator = stream(draw.seed, "machine", "cuff_sensors")
    drawn = generator.standard_normal((2, len(draw.description.settings.cuffs), 6))
    return TrueCuffSensors(
        gain=1.0 + sd["gain"] * drawn[0],
        bias=np.repeat([sd["force_bias"], sd["torque_bias"]], 3) * drawn[1],
        noise=np.repeat([sd["force_noise"], sd["torque_noise"]], 3),
    )


def _tilted_gravity(roll: float, pitch: float) -> Float[np.ndarray, " 3"]:
    """Gravity in a base that is turned by `roll` about x, then by `pitch` about y [m/s²]."""
    down = np.array([np.sin(pitch), -np.sin(roll) * np.cos(pitch), -np.cos(roll) * np.cos(pitch)])
    return GRAVITY * down
