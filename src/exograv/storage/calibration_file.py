"""File `calibration.toml`: written completely or not at all, sealed by a hash, refused on another machine."""

import itertools
import shlex
from collections.abc import Iterator
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
TWIN, FITTED_TWIN, SIMULATED = "twin, ", "fitted twin ", ", simulated"
"""Begins of the identity of a twin without drives, drawn and fitted, and mark in that of simulated drives."""
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


def refuse_to_replace(path: Path, machine: str) -> None:
    """Check before a run that the calibration of `machine` will not replace that of another real machine.

    Simulated machines may replace each other. A file that cannot be read may be replaced.

    Raises:
        ConfigError: There is a calibration of another real machine.
    """
    try:
        stored = read_calibration(path).identity
    except ConfigError:
        return
    if stored.machine != machine and not is_virtual(stored.machine):
        raise ConfigError(
            f"{path} is the calibration of the machine '{stored.machine}' ({stored.rig}), and that of '{machine}' "
            f"would replace it. Give another {OPTION}."
        )


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


def _is_kept(stored: Identity, present: Identity) -> bool:
    """Return True if the stored calibration is still of use, so that no advice may replace it.

    That of another description of the same machine is of no use; that of a simulated machine is computed again.
    """
    if stored.model_copy(update={"rig_sha256": present.rig_sha256}) == present:
        return False
    return not is_virtual(stored.machine) or (SIMULATED in stored.machine) != (SIMULATED in present.machine)


def _beside(path: Path, make: str) -> str:
    """Return the advice to calibrate into a file beside `path`, which stays as it is."""
    free = next(one for one in _names_beside(path) if not one.exists())
    command = make.partition(" --calibration ")[0]
    return f"Calibrate this machine into a file of its own: `{command} --calibration {shlex.quote(str(free))}`."


def _names_beside(path: Path) -> Iterator[Path]:
    return (path.with_stem(f"{path.stem}_{number}") for number in itertools.count(2))


def _over_drives(stored: Identity, present: Identity) -> str:
    """Return a sentence for a calibration over simulated drives that a command without drives cannot use."""
    if SIMULATED not in stored.machine or not present.machine.startswith((TWIN, FITTED_TWIN)):
        return ""
    return "The file is of simulated drives (--simulate), and this command simulates a machine without drives. "


def is_virtual(machine: str) -> bool:
    """Return True for the identity of a machine that exists in simulation only: a twin, or simulated drives."""
    return machine.startswith((TWIN, FITTED_TWIN)) or SIMULATED in machine


def refuse_unfit(
    path: Path, whole: StoredCalibration, description: RigDescription, machine: str, now: datetime, make: str = MAKE
) -> None:
    """Refuse a calibration of another machine, or one that is too old. `make` calibrates this machine.

    Raises:
        ConfigError: The calibration is of another machine, too old, or from the future.
    """
    present, again = identity_of(description, machine), _again(make)
    own = f"Give this machine's own file with --calibration. {_over_drives(whole.identity, present)}"
    is_kept = _is_kept(whole.identity, present)
    refuse_other_machine(path, whole.identity, present, own + (_beside(path, make) if is_kept else again))
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
    return f"{TWIN}level {level}, seed {seed}{in_world(world)}"


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
