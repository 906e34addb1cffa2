"""File `calibration.toml`: written completely or not at all, sealed by a hash, refused on another machine."""

from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path
from typing import Literal

from exograv.errors import ConfigError
from exograv.model.description import RigDescription
from exograv.options import WorldName

from .calibration_schema import Identity, StoredCalibration
from .sealed_file import read_sealed, refuse_other_kind, write_sealed

GAIN_AGE_MAX = timedelta(days=30)
"""Largest age of a calibration.

Gears wear in, and belts and screws settle (assumed).
"""
FRICTION_AGE_MAX = timedelta(hours=12)
"""Age above which friction should be checked again; it changes with temperature (docs/howto/calibration.md)."""
CLOCK_ERROR = timedelta(minutes=10)
"""Largest time by which the clock that wrote a file may be ahead."""
OPTION = "--calibration or --out"
MAKE = "exograv rig calibrate"
"""Command that calibrates a machine, if the reader of the file does not know the options of this machine."""
HEAD = """\
# Calibration of an empty machine, written by `exograv rig calibrate` (docs/howto/calibration.md). Each value has its
# standard deviation beside it (_sd). Do not edit: a changed file is refused.
"""


def identity_of(description: RigDescription, machine: str) -> Identity:
    """Identity of the machine with this serial number, or of the twin with this level and seed."""
    return Identity(rig=description.name, side=description.side, machine=machine, rig_sha256=description.sha256)


def write_calibration(path: Path, whole: StoredCalibration) -> None:
    """Write the file, or leave the old one as it was.

    Raises:
        ConfigError: The file cannot be written.
    """
    write_sealed(path, whole, HEAD, OPTION)


def refuse_other_than_calibration(path: Path) -> None:
    """Check before a run that its calibration will not replace another kind of file.

    Raises:
        ConfigError: There is a file of another kind.
    """
    refuse_other_kind(path, StoredCalibration, HEAD, OPTION)


def read_calibration(path: Path, make: str = MAKE) -> StoredCalibration:
    """Read a calibration file.

    Args:
        path: The file.
        make: Command that makes the calibration, for the advice in a message.

    Raises:
        ConfigError: The file cannot be read, is of another version, or its values do not match its hash.
    """
    give = f"Calibrate this machine first (`{make}`), or give its calibration.toml with --calibration."
    return read_sealed(path, StoredCalibration, give, _again(make))


def _again(make: str) -> str:
    return f"Calibrate again: `{make}`."


def refuse_unfit(
    path: Path, whole: StoredCalibration, description: RigDescription, machine: str, now: datetime, make: str = MAKE
) -> None:
    """Refuse a calibration of another machine, or one that is too old. `make` calibrates this machine.

    Raises:
        ConfigError: The calibration is of another machine, too old, or from the future.
    """
    present, again = identity_of(description, machine), _again(make)
    what_to_do = f"Give this machine's own file with --calibration. {again}"
    refuse_other_machine(path, whole.identity, present, what_to_do)
    joints = tuple(row.joint for row in whole.joints)
    if joints != description.joints:
        raise ConfigError(f"{path} has the joints {', '.join(joints)}; they must be {', '.join(description.joints)}.")
    age = now - whole.measured.at_utc
    if age > GAIN_AGE_MAX:
        raise ConfigError(
            f"{path} is stale: it was measured {age.days} days ago; {GAIN_AGE_MAX.days} days are allowed. {again}"
        )
    if -min(age, now - whole.measured.friction_at_utc) > CLOCK_ERROR:
        raise ConfigError(
            f"{path} is from the future: measured at {whole.measured.friction_at_utc:%Y-%m-%d %H:%M} UTC, now it is "
            f"{now:%Y-%m-%d %H:%M} UTC. Set the clock. {again}"
        )


def refuse_other_machine(path: Path, stored: Identity, present: Identity, what_to_do: str) -> None:
    """Refuse a file of another machine, of the other side, or of this machine with another description.

    Raises:
        ConfigError: The file is of another machine or description.
    """
    for name, expected in present.model_dump().items():
        found = getattr(stored, name)
        if found != expected:
            what = {
                "rig_sha256": f"of {present.rig} with another rig.toml or URDF (hash {found[:12]}…, now "
                f"{expected[:12]}…)"
            }.get(name, f"of another machine: its {name} is '{found}', this one's is '{expected}'")
            raise ConfigError(f"{path} is {what}. {what_to_do}")


def friction_warning(whole: StoredCalibration, now: datetime) -> str | None:
    """Return advice for friction that was measured too long ago; None if it is recent enough."""
    age = now - whole.measured.friction_at_utc
    if age <= FRICTION_AGE_MAX:
        return None
    hours, allowed = age.total_seconds() / 3600, FRICTION_AGE_MAX.total_seconds() / 3600
    return (
        f"Friction was measured {hours:.0f} h ago; after {allowed:.0f} h it should be checked: "
        "`exograv rig calibrate --recheck`."
    )


def twin_identity(level: int, seed: int, world: WorldName = "home") -> str:
    """Identity of a virtual machine, in place of a serial number."""
    return f"twin, level {level}, seed {seed}{in_world(world)}"


def in_world(world: WorldName) -> str:
    """Return the end of the identity of a virtual machine: empty at home, where no law is foreign."""
    return "" if world == "home" else f", world {world}"


@dataclass(frozen=True)
class CalibrationUsed:
    """Identity of the stored calibration that a run took."""

    source: Literal["stored"]
    hash: str
    measured_utc: str
    friction_measured_utc: str
    warning: str | None


@dataclass(frozen=True)
class TakenCalibration:
    """A stored calibration that fits the machine."""

    whole: StoredCalibration
    warning: str | None

    @property
    def used(self) -> CalibrationUsed:
        """Identity of the calibration, for figures and recordings."""
        measured = self.whole.measured
        at_utc, friction_at_utc = measured.at_utc.isoformat(), measured.friction_at_utc.isoformat()
        return CalibrationUsed("stored", self.whole.content_sha256, at_utc, friction_at_utc, self.warning)


def take_calibration(
    file: Path, description: RigDescription, machine: str, now: datetime, make: str = MAKE
) -> TakenCalibration:
    """Read a calibration, and check that it is of this machine and recent. `make` calibrates this machine.

    Raises:
        ConfigError: The calibration is damaged, of another machine or too old.
    """
    whole = read_calibration(file, make)
    refuse_unfit(file, whole, description, machine, now, make)
    return TakenCalibration(whole, friction_warning(whole, now))
