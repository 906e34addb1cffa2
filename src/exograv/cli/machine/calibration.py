"""`exograv calibrate`: calibrate an empty machine of the twin, or check its friction again, and keep the file."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from exograv.errors import ConfigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.laboratory.calibration_outcome import calibration_figures, warnings
from exograv.laboratory.twin_calibration import EmptyTwin, pilots
from exograv.live.on_drives.calibration import calibrated_on_drives, rechecked_on_drives, settings_of_lengths
from exograv.live.on_drives.connection import DrivesAsked, Say, connected
from exograv.loop.pilot import Progress
from exograv.model.description import RigDescription, Side, load_rig
from exograv.procedures.calibration.breakaway_checks import refuse_joints_without_motor
from exograv.rig.twin import Disturbances, Machine, draw_machine
from exograv.storage.bring_up_sheet import FILE as SHEET
from exograv.storage.bring_up_sheet import refuse_not_brought_up
from exograv.storage.calibration_file import (
    identity_of,
    take_calibration,
    twin_identity,
    write_calibration,
)
from exograv.storage.calibration_schema import MeasurementConditions, stored

FILE = "calibration.toml"


@dataclass(frozen=True)
class CalibrateOptions:
    """What the calibration is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    file: Path = Path("out") / FILE
    """Where the calibration is kept."""
    recheck: bool = False
    """Only friction, of the calibration in that file."""
    drives: Path | None = None
    """drives.toml of a real machine; the twin is calibrated where it is absent and nothing simulated."""
    simulate: bool = False
    """Whether drives are simulated in another process."""
    lengths: tuple[str, ...] = ()
    """SEGMENT=METRES that a machine on drives is set to; nominal where absent."""

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if self.lengths and self.drives is None:
            raise ConfigError(
                f"--length is {self.lengths[0]}, and nobody sets a simulated machine. Leave it out, or give --drives."
            )

    @property
    def is_on_drives(self) -> bool:
        """Whether the machine is reached over its bus."""
        return self.drives is not None or self.simulate


def run_calibration(
    options: CalibrateOptions, progress: Progress, say: Say = lambda _: None, now: datetime | None = None
) -> dict[str, Any]:
    """Run it; the result follows the contract of `exograv calibrate --json`.

    Args:
        options: What it is asked for.
        progress: Told now and then.
        say: Shows a line to whoever hangs the weights on a real machine.
        now: On the wall; this moment where absent.

    Raises:
        ConfigError: The rig or the stored file cannot be used.
        IdentificationError: The machine is not what it should be.
        RigError: The envelope stopped the run.
    """
    start, now = time.perf_counter(), (now or datetime.now(UTC)).replace(microsecond=0)
    description = load_rig(options.rig, options.side)
    refuse_joints_without_motor(description)
    done = (_on_drives if options.is_on_drives else _on_twin)(options, description, progress, say, now)
    identity = identity_of(description, done.serial)
    whole = stored(done.calibration, identity, done.measured, description.joints)
    write_calibration(options.file, whole)
    t = done.measured.running_s
    return {
        "rig": description.name,
        "side": description.side,
        "disturbance_level": options.level,
        "seed": options.seed,
        "machine": identity.machine,
        **calibration_figures(done.calibration, description.joints, done.truth, t),
        "warnings": warnings(done.calibration, description),
        "hash": whole.content_sha256,
        "file": str(options.file),
        "measured_utc": done.measured.at_utc.isoformat(),
        "friction_measured_utc": done.measured.friction_at_utc.isoformat(),
        "simulated_s": round(t, 3),
        "wall_s": round(time.perf_counter() - start, 2),
    }


@dataclass(frozen=True)
class _Done:
    """What either way of calibrating leaves."""

    calibration: Calibration
    measured: MeasurementConditions
    serial: str
    truth: Machine | None
    """Of a machine that is only computed; for the figures."""


def _on_twin(
    options: CalibrateOptions, description: RigDescription, progress: Progress, _say: Say, now: datetime
) -> _Done:
    machine = draw_machine(description, Disturbances.at_level(options.level), options.seed)
    lengths = settings_of_lengths(description, ())
    empty = EmptyTwin(description, machine, options.seed, lengths)
    serial = twin_identity(options.level, options.seed)
    pilot_of = pilots(description, progress)
    if options.recheck:
        before = take_calibration(options.file, description, serial, now).whole
        calibration, t = empty.recheck(before.calibration(), pilot_of)
        return _Done(calibration, _checked_again(before.measured, now, t), serial, machine)
    calibration, t = empty.calibrate(pilot_of)
    return _Done(calibration, _measured(now, t, lengths), serial, machine)


def _on_drives(
    options: CalibrateOptions, description: RigDescription, progress: Progress, say: Say, now: datetime
) -> _Done:
    lengths = settings_of_lengths(description, options.lengths)
    asked = DrivesAsked(options.drives, options.simulate, options.level, options.seed)
    truth = None
    if options.simulate:
        truth = draw_machine(description, Disturbances.at_level(options.level), options.seed)
    with connected(asked, description, say, "A calibration") as machine:
        if not options.simulate:
            refuse_not_brought_up(options.file.parent / SHEET, description, machine.drives)
        if options.recheck:
            before = take_calibration(options.file, description, machine.serial, now).whole
            known = before.calibration()
            set_to = before.measured.lengths_m
            calibration, t = rechecked_on_drives(machine, description, set_to, known, progress)
            return _Done(calibration, _checked_again(before.measured, now, t), machine.serial, truth)
        calibration, t = calibrated_on_drives(machine, description, lengths, progress)
        return _Done(calibration, _measured(now, t, lengths), machine.serial, truth)


def _measured(now: datetime, t: float, lengths: Mapping[str, float]) -> MeasurementConditions:
    return MeasurementConditions(at_utc=now, friction_at_utc=now, running_s=round(t, 3), lengths_m=dict(lengths))


def _checked_again(before: MeasurementConditions, now: datetime, t: float) -> MeasurementConditions:
    return before.model_copy(update={"friction_at_utc": now, "running_s": round(t, 3)})
