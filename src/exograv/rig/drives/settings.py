"""A laboratory's `drives.toml`: the bus of one machine and the drive of each of its joints, checked on load."""

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
"""By the names of their tables."""


class UdpBus(Settings):
    """A real-time controller of the laboratory's own, which speaks `docs/udp_protocol.md`."""

    host: str = "127.0.0.1"
    """Where it listens."""

    port: Port = 47100


class CanopenBus(Settings):
    """A CAN bus with CiA 402 drives, by any adapter that python-can knows."""

    interface: str
    """As python-can names it: socketcan, pcan, kvaser, udp_multicast …"""

    channel: str
    bitrate: int | None = None
    """Where the adapter sets it; socketcan has it from `ip link` [bit/s]."""


class MoteusBus(Settings):
    """moteus controllers behind a CAN-FD adapter that speaks fdcanusb's lines."""

    path: Annotated[str, Field(min_length=1)]
    """Of its serial port, such as /dev/serial/by-id/usb-mjbots_fdcanusb_…-if00."""


AnyBus = TypeVar("AnyBus", UdpBus, CanopenBus, MoteusBus)


class Drive(Settings):
    """One drive, and how its numbers become those of the joint."""

    joint: str
    node: NodeId
    """Its address on the bus."""

    sign: Literal[1, -1] = 1
    """-1 where the drive's positive direction is the joint's negative one; of position and current."""

    counts_per_turn: PositiveFloat | None = None
    """Of the position that it reports, in one turn of the joint; a bus that speaks in radians has none."""

    motor_counts_per_turn: PositiveFloat | None = None
    """The same of the encoder on the motor's shaft, in one turn of the joint; absent where it reports none."""

    offset_deg: float = 0.0
    """Of the joint where the drive reports 0, after `sign`."""

    current_rated_A: PositiveFloat
    """What the drive's per mille are of."""

    current_max_A: PositiveFloat
    """To which the drive limits itself."""

    brake_Nms_per_rad: NonNegativeFloat
    """With which it brakes its joint when it is told nothing, or not believed: short-circuited windings, or a law of
    its own. 0 if it lets go: such a machine is not to be worn (docs/safety.md, SS4)."""

    @model_validator(mode="after")
    def _limits_agree(self) -> "Drive":
        if self.current_max_A < self.current_rated_A:
            raise ValueError(
                f"{self.joint}: current_max_A {self.current_max_A:g} is below current_rated_A "
                f"{self.current_rated_A:g}; a drive that may not give its rated current has the two exchanged"
            )
        return self


class DrivesSettings(Settings):
    """The whole `drives.toml`."""

    schema_version: Literal[1]
    rig: str
    """The machine that these drives move."""

    serial: Annotated[str, Field(min_length=1)]
    """Which one of its kind: calibration and self-test belong to it."""

    period_ms: Literal[1, 2, 4] = 1
    """Of the loop: what the bus carries. Four drives on CAN at 1 Mbit/s need 2."""

    watchdog_ms: Annotated[float, Field(ge=5.0, le=30.0)] = 20.0
    """After which each drive brakes by itself if it is told nothing (docs/safety.md: 20 to 30 at most)."""

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
        """The one that is named."""
        return next(name for name in BUSES if getattr(self, name) is not None)


@dataclass(frozen=True)
class Drives:
    """The drives of one machine, in the order of its joints."""

    settings: DrivesSettings
    each: tuple[Drive, ...]
    sha256: str
    """Of the file."""

    @property
    def joints(self) -> tuple[str, ...]:
        """As in the machine's description."""
        return tuple(drive.joint for drive in self.each)

    def table(self, kind: type[AnyBus]) -> AnyBus:
        """Settings of the bus.

        Raises:
            ConfigError: `drives.toml` names another bus.
        """
        found = getattr(self.settings, self.settings.bus)
        if not isinstance(found, kind):
            raise ConfigError(f"drives.toml names the bus [{self.settings.bus}], which is not {kind.__name__}.")
        return found

    @property
    def period_s(self) -> float:
        """Of the loop [s]."""
        return 1e-3 * self.settings.period_ms

    @property
    def watchdog_s(self) -> float:
        """Of each drive [s]."""
        return 1e-3 * self.settings.watchdog_ms

    @property
    def sign(self) -> Float[np.ndarray, " joint"]:
        """Of position and current."""
        return np.array([float(drive.sign) for drive in self.each])

    @property
    def offset(self) -> Float[np.ndarray, " joint"]:
        """Of the joint where the drive reports 0 [rad]."""
        return np.deg2rad([drive.offset_deg for drive in self.each])

    @property
    def rad_per_count(self) -> Float[np.ndarray, " joint"]:
        """Of the reported position; 1 where the bus speaks in radians."""
        return np.array([_rad_per(drive.counts_per_turn) for drive in self.each])

    @property
    def rad_per_motor_count(self) -> Float[np.ndarray, " joint"] | None:
        """The same of the motors' encoders; None where not all drives have one that the bus carries."""
        is_counted = self.settings.canopen is not None
        is_missing = is_counted and any(drive.motor_counts_per_turn is None for drive in self.each)
        if is_missing or self.settings.moteus is not None:
            return None
        return np.array([_rad_per(drive.motor_counts_per_turn) for drive in self.each])

    @property
    def without_brake(self) -> tuple[str, ...]:
        """Joints whose drives let go when they are told nothing."""
        return tuple(drive.joint for drive in self.each if drive.brake_Nms_per_rad == 0.0)


def _rad_per(counts: float | None) -> float:
    return 1.0 if counts is None else 2.0 * np.pi / counts


def load_drives(path: Path, description: RigDescription) -> Drives:
    """Read how a machine's drives are wired.

    Raises:
        ConfigError: The file cannot be read, holds something that cannot be used, or is of another machine.
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
            f"{path} has the drives of '{settings.rig}', and the machine is '{description.name}'. Give the file of "
            "this machine, or --rig with the other."
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
