"""Calibrations of virtual machines that are kept between runs, for `--calibration auto`.

A calibration is taken again only for the same machine (rig, side, level, seed, lengths) and the same source of this
package. Another day's friction is not in it: after `GAIN_AGE_MAX` the machine is calibrated anew.
"""

import os
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from exograv import kernel
from exograv.errors import ConfigError
from exograv.identification.calibration.empty_machine import Calibration
from exograv.storage.calibration_file import TakenCalibration, identity_of, take_calibration, write_calibration
from exograv.storage.calibration_schema import MeasurementConditions, stored

from .virtual_laboratory import VirtualLaboratory

AUTO = Path("auto")
"""Value of `--calibration` that asks for the kept calibration."""


def kept_file(laboratory: VirtualLaboratory, seed: int) -> Path | None:
    """Path of the kept calibration of this machine, whose run draws its noise from `seed`.

    None while the source of this package is being edited.
    """
    source = kernel.source_digest()
    if source is None:
        return None
    machine = laboratory.description.sha256, laboratory.description.side, laboratory.serial, seed, _lengths(laboratory)
    name = kernel.content_digest((*machine, source))
    base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    return base / "exograv" / "calibrations" / f"{name}.toml"


def take_kept(file: Path, laboratory: VirtualLaboratory) -> TakenCalibration | None:
    """Return the kept calibration; None if there is none that fits, so that the machine is calibrated."""
    try:
        return take_calibration(file, laboratory.description, laboratory.serial, datetime.now(UTC))
    except ConfigError:
        return None


def keep(file: Path, laboratory: VirtualLaboratory, calibration: Calibration, running_s: float) -> None:
    """Keep a calibration that ended `running_s` after the machine was switched on.

    Raises:
        ConfigError: The file cannot be written.
    """
    now = datetime.now(UTC).replace(microsecond=0)
    measured = MeasurementConditions(
        at_utc=now, friction_at_utc=now, running_s=round(running_s, 3), lengths_m=_lengths(laboratory)
    )
    identity = identity_of(laboratory.description, laboratory.serial)
    file.parent.mkdir(parents=True, exist_ok=True)
    write_calibration(file, stored(calibration, identity, measured, laboratory.description.joints))


def _lengths(laboratory: VirtualLaboratory) -> dict[str, float]:
    lengths: Mapping[str, float] = laboratory.wearer.lengths_given
    return {segment: float(length) for segment, length in lengths.items()}
