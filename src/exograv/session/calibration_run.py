"""`exograv calibrate`: calibrate an empty machine of the twin, or check its friction again, and keep the file."""

import time
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from exograv.dynamics.actuator import ActuatorGain
from exograv.errors import ConfigError
from exograv.model.description import RigDescription, Side, load_rig
from exograv.rig.twin import Disturbances, Twin, draw_machine
from exograv.safety.envelope import Envelope

from .calibration_file import friction_warning, identity_of, read_calibration, refuse_unfit, write_calibration
from .calibration_outcome import calibration_figures, warnings
from .calibration_schema import Measured, StoredCalibration, stored
from .nudge_checks import refuse_joints_without_motor
from .pilot import Pilot, Progress
from .stage_0 import EmptyTwin
from .virtual import limits

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

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")


def twin_identity(level: int, seed: int) -> str:
    """What stands for the serial number of a virtual machine."""
    return f"twin, level {level}, seed {seed}"


def run_calibration(options: CalibrateOptions, progress: Progress, now: datetime | None = None) -> dict[str, Any]:
    """Run it; the result follows the contract of `exograv calibrate --json`.

    Raises:
        ConfigError: The rig or the stored file cannot be used.
        IdentificationError: The machine is not what it should be.
        RigError: The envelope stopped the run.
    """
    start, now = time.perf_counter(), (now or datetime.now(UTC)).replace(microsecond=0)
    description = load_rig(options.rig, options.side)
    refuse_joints_without_motor(description)
    machine = draw_machine(description, Disturbances.at_level(options.level), options.seed)
    lengths = {adjustment.segment: adjustment.nominal_m for adjustment in description.settings.adjustments}
    empty = EmptyTwin(description, machine, options.seed, lengths)

    def pilot_of(twin: Twin, gains: ActuatorGain) -> Pilot:
        return Pilot(twin, gains, Envelope(limits(description), twin.period_s), None, progress)

    if options.recheck:
        before = take_calibration(options.file, description, twin_identity(options.level, options.seed), now).whole
        calibration, t = empty.recheck(before.calibration(), pilot_of)
        measured = before.measured.model_copy(update={"friction_at_utc": now, "running_s": round(t, 3)})
    else:
        calibration, t = empty.calibrate(pilot_of)
        measured = Measured(at_utc=now, friction_at_utc=now, running_s=round(t, 3), lengths_m=lengths)
    identity = identity_of(description, twin_identity(options.level, options.seed))
    whole = stored(calibration, identity, measured, description.joints)
    write_calibration(options.file, whole)
    return {
        "rig": description.name,
        "side": description.side,
        "disturbance_level": options.level,
        "seed": options.seed,
        "machine": identity.machine,
        **calibration_figures(calibration, description.joints, machine, t),
        "warnings": warnings(calibration, description),
        "hash": whole.content_sha256,
        "file": str(options.file),
        "measured_utc": measured.at_utc.isoformat(),
        "friction_measured_utc": measured.friction_at_utc.isoformat(),
        "simulated_s": round(t, 3),
        "wall_s": round(time.perf_counter() - start, 2),
    }


@dataclass(frozen=True)
class TakenCalibration:
    """A stored calibration that fits the machine."""

    whole: StoredCalibration
    warning: str | None

    @property
    def used(self) -> dict[str, Any]:
        """Which one it is, for figures and recordings."""
        measured = self.whole.measured
        return {
            "source": "stored",
            "hash": self.whole.content_sha256,
            "measured_utc": measured.at_utc.isoformat(),
            "friction_measured_utc": measured.friction_at_utc.isoformat(),
            "warning": self.warning,
        }


def take_calibration(file: Path, description: RigDescription, machine: str, now: datetime) -> TakenCalibration:
    """Read a calibration and make sure that it is this machine's and recent.

    Raises:
        ConfigError: It is damaged, foreign or stale.
    """
    whole = read_calibration(file)
    refuse_unfit(file, whole, description, machine, now)
    return TakenCalibration(whole, friction_warning(whole, now))
