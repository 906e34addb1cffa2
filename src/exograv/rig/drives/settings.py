"""Settings of a laboratory's `drives.toml`: the bus of one machine and the drive of each joint, checked on load."""

import hashlib
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, TypeVar

import numpy as np
from jaxtyping import Float
from pydantic import Field, NonNegativeFloat, PositiveFloat, ValidationError, model_validator

from exograv.errors import ConfigError
from exograv.model.description import RigDescription, validation_sentences
from exograv.model.rig_settings import Settings

NodeId = Annotated[int, Field(ge=1, le=127)]
Port = Annotated[int, Field(ge=1, le=65535)]
BUSES = ("udp", "canopen", "moteus")
"""Names of the buses, which are the names of their tables."""


class UdpBus(Settings):
    """Real-time controller of the laboratory's own, with the protocol of `docs/reference/udp_protocol.md`."""

    host: str = "127.0.0.1"
    """Address at which the controller listens."""

    port: Port = 47100


class CanopenBus(Settings):
    """CAN bus with CiA 402 drives, on any adapter that python-can supports."""

    interface: str
    """Interface in the terms of python-can: socketcan, pcan, kvaser, udp_multicast …"""

    channel: str
    bitrate: int | None = None
    """Bit rate, for adapters that set it; socketcan has it from `ip link` [bit/s]."""


class MoteusBus(Settings):
    """moteus controllers behind a CAN-FD adapter with the fdcanusb protocol."""

    path: Annotated[str, Field(min_length=1)]
    """Path of the serial port, such as /dev/serial/by-id/usb-mjbots_fdcanusb_…-if00."""


AnyBus = TypeVar("AnyBus", UdpBus, CanopenBus, MoteusBus)


class Drive(Settings):
    """Settings of one drive, and the conversion of its numbers to those of the joint."""

    joint: str
    node: NodeId
    """Address of the drive on the bus."""

    sign: Literal[1, -1] = 1
    """Sign of position and current: -1 if the drive's positive direction is the joint's negative one."""

    counts_per_turn: PositiveFloat | None = None
    """Counts of the reported position per turn of the joint; absent on a bus that reports radians."""

    motor_counts_per_turn: PositiveFloat | None = None
    """Counts of the encoder on the motor's shaft per turn of the joint; absent if the drive reports none."""

    offset_deg: float = 0.0
    """Angle of the joint where the drive reports 0, after `sign`."""

    current_rated_A: PositiveFloat
    """Rated current of the motor; the drive reports and takes per mille of it."""

    current_max_A: PositiveFloat
    """Largest current that the drive allows itself [A]."""

    brake_Nms_per_rad: NonNegativeFloat
    """Damping with which the drive brakes its joint without valid commands.

    The drive shorts its windings or uses a law of its own. 0 if the drive lets go: no person may wear such a machine
    (docs/explanation/safety.md, SS4).
    """

    @model_validator(mode="after")
    def _limits_agree(self) -> "Drive":
        if self.current_max_A < self.current_rated_A:
            raise ValueError(
                f"{self.joint}: current_max_A {self.current_max_A:g} is below current_rated_A "
                f"{self.current_rated_A:g}; a drive can give at least its rated current: are the two exchanged?"
            )
        return self


class DrivesSettings(Settings):
    """Settings of a `drives.toml`: one bus, and one drive per joint."""

    schema_version: Literal[1]
    rig: str
    """Name of the machine that these drives move."""

    serial: Annotated[str, Field(min_length=1)]
    """Serial number of the machine. Calibration and self-test belong to this one machine."""

    period_ms: Literal[1, 2, 4] = 1
    """Period of the loop, limited by the bus: four drives on CAN at 1 Mbit/s need 2."""

    watchdog_ms: Annotated[float, Field(ge=5.0, le=30.0)] = 20.0
    """Time without a command after which each drive brakes by itself (docs/explanation/safety.md: 20 to 30 at most)."""

    udp: UdpBus | None = None
    canopen: CanopenBus | None = None
    moteus: MoteusBus | None = None
    drives: Annotated[list[Drive], Field(min_length=1)]

    @model_validator(mode="after")
    def _one_bus(self) -> "DrivesSettings":
        named = [name for name in BUSES if getattr(self, name) is not None]
        if len(named) != 1:
            buses = " or ".join(f"[{name}]" for name in BUSES)
            raise ValueError(f"one bus is needed, {buses}; named: {' and '.join(named) or 'none'}")
        for kind in ("joint", "node"):
            values = [getattr(drive, kind) for drive in self.drives]
            twice = sorted({str(value) for value in values if values.count(value) > 1})
            if twice:
                raise ValueError(f"two drives have {kind} {', '.join(twice)}")
        if self.moteus is not None and (counting := [d.joint for d in self.drives if d.counts_per_turn is not None]):
            raise ValueError(
                f"counts_per_turn is set for {', '.join(counting)}: a moteus speaks in turns of the joint; set its "
                "motor_position.rotor_to_output_ratio instead"
            )
        if self.canopen is not None and (bare := [d.joint for d in self.drives if d.counts_per_turn is None]):
            raise ValueError(f"counts_per_turn is missing for {', '.join(bare)}: CiA 402 drives report counts")
        return self

    @property
    def bus(self) -> str:
        """Name of the bus in the file."""
        return next(name for name in BUSES if getattr(self, name) is not None)


@dataclass(frozen=True)
class Drives:
    """Drives of one machine, in the order of its joints."""

    settings: DrivesSettings
    each: tuple[Drive, ...]
    sha256: str
    """Hash of the file."""

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints as in the machine's description."""
        return tuple(drive.joint for drive in self.each)

    def table(self, kind: type[AnyBus]) -> AnyBus:
        """Return the settings of the bus.

        Raises:
            ConfigError: `drives.toml` names another bus.
        """
        found = getattr(self.settings, self.settings.bus)
        if not isinstance(found, kind):
            raise ConfigError(f"drives.toml names the bus [{self.settings.bus}], which is not {kind.__name__}.")
        return found

    @property
    def period_s(self) -> float:
        """Period of the loop [s]."""
        return 1e-3 * self.settings.period_ms

    @property
    def watchdog_s(self) -> float:
        """Time-out of each drive's watchdog [s]."""
        return 1e-3 * self.settings.watchdog_ms

    @property
    def sign(self) -> Float[np.ndarray, " joint"]:
        """Sign of position and current, by joint."""
        return np.array([float(drive.sign) for drive in self.each])

    @property
    def offset(self) -> Float[np.ndarray, " joint"]:
        """Angle of the joint where the drive reports 0 [rad]."""
        return np.deg2rad([drive.offset_deg for drive in self.each])

    @property
    def rad_per_count(self) -> Float[np.ndarray, " joint"]:
        """Radians per count of the reported position; 1 if the bus reports radians."""
        return np.array([_rad_per(drive.counts_per_turn) for drive in self.each])

    @property
    def rad_per_motor_count(self) -> Float[np.ndarray, " joint"] | None:
        """Radians per count of the motors' encoders; None if a drive has none or the bus does not carry them."""
        is_counted = self.settings.canopen is not None
        is_missing = is_counted and any(drive.motor_counts_per_turn is None for drive in self.each)
        if is_missing or self.settings.moteus is not None:
            return None
        return np.array([_rad_per(drive.motor_counts_per_turn) for drive in self.each])

    @property
    def without_brake(self) -> tuple[str, ...]:
        """Joints whose drives let go without commands."""
        return tuple(drive.joint for drive in self.each if drive.brake_Nms_per_rad == 0.0)


def _rad_per(counts: float | None) -> float:
    return 1.0 if counts is None else 2.0 * np.pi / counts


def load_drives(path: Path, description: RigDescription) -> Drives:
    """Read the wiring of a machine's drives.

    Raises:
        ConfigError: The file cannot be read, has an unusable entry, or belongs to another machine.
    """
    try:
        text = path.read_bytes()
        settings = DrivesSettings.model_validate(tomllib.loads(text.decode("utf-8")))
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}. Give the path of a drives.toml.") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not valid TOML: {error}. Correct it there.") from error
    except ValidationError as error:
        raise ConfigError(f"{path}: {validation_sentences(error)} Correct it there.") from error
    if settings.rig != description.name:
        raise ConfigError(
            f"{path} has the drives of '{settings.rig}', but the machine is '{description.name}'. Give the file of "
            "this machine, or choose the other machine with --rig."
        )
    by_joint = {drive.joint: drive for drive in settings.drives}
    if set(by_joint) != set(description.joints):
        missing = [joint for joint in description.joints if joint not in by_joint]
        unknown = [joint for joint in by_joint if joint not in description.joints]
        raise ConfigError(
            f"{path}: every joint needs one drive; without: {', '.join(missing) or 'none'}, unknown: "
            f"{', '.join(unknown) or 'none'}. The joints of {description.name} are {', '.join(description.joints)}."
        )
    each = tuple(by_joint[joint] for joint in description.joints)
    return Drives(settings, each, hashlib.sha256(text).hexdigest())
