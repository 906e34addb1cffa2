"""`exograv rig calibrate`: calibrate an empty machine or check its friction again, store the file and the figures."""

import contextlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

import numpy as np

from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.calibration.empty_prior import EmptyPrior
from exograv.identification.calibration.twin_prior import twin_prior
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.model.rig_settings import Excitation
from exograv.next_command import calibration_command
from exograv.options import OUT, WorldName
from exograv.results import MERGED
from exograv.storage.calibration_file import (
    identity_of,
    read_calibration,
    refuse_other_than_calibration,
    refuse_to_replace,
    take_calibration,
    write_calibration,
)
from exograv.storage.calibration_schema import MeasurementConditions, stored
from exograv.storage.twin_file import read_twin

from .breakaway_checks import refuse_joints_without_motor
from .empty_motion import read_empty_motion
from .figures import CalibrationFigures, CalibrationTruth, calibration_figures, twin_warnings, warnings
from .known_weights import refuse_heavy_weights
from .options import CalibrateOptions
from .segment_lengths import settings_of_lengths

TruthAt = Callable[[float], CalibrationTruth]
"""Function that returns the true values of a simulated machine at a time of its clock [s]."""


@dataclass(frozen=True)
class CalibrationResult:
    """Result of `exograv rig calibrate`."""

    rig: str
    side: str
    disturbance_level: int
    world: WorldName
    seed: int
    machine: str
    """Serial number, or identity of the twin."""
    figures: CalibrationFigures = field(metadata=MERGED)
    warnings: list[str]
    hash: str
    file: Path
    measured_utc: str
    friction_measured_utc: str
    simulated_s: float
    wall_s: float


class EmptyMachine(Protocol):
    """Empty machine that is calibrated, real or simulated."""

    @property
    def serial(self) -> str:
        """Serial number, or identity of the twin."""
        ...

    @property
    def truth(self) -> TruthAt | None:
        """True values of a simulated machine; None for a real one."""
        ...

    def calibrate(
        self, lengths: Mapping[str, float], motion: Excitation | None, known: EmptyPrior | None
    ) -> tuple[Calibration, float]:
        """Run from the first breakaway test to the last weight, and along a motion if there is one.

        The data sheet is the prior of the fit if nothing else is `known`.

        Return the calibration and the running time [s].
        """
        ...

    def recheck(self, before: Calibration, lengths: Mapping[str, float]) -> tuple[Calibration, float]:
        """Measure friction again; keep the rest of `before`. Return the calibration and the running time [s]."""
        ...


def _known(options: CalibrateOptions, description: RigDescription, lengths: Mapping[str, float]) -> EmptyPrior | None:
    """Return what the machine's twin tells; None without --prior twin."""
    if options.prior != "twin":
        return None
    whole, tree = read_twin(description), adjusted(read_exoskeleton(description), description, lengths)
    return twin_prior(description, tree, whole.layout(), np.array(whole.posterior.mean), whole.posterior.matrix())


def calibrate_and_keep(
    options: CalibrateOptions,
    file: Path,
    connect: Callable[[RigDescription], contextlib.AbstractContextManager[EmptyMachine]],
    now: datetime | None = None,
) -> CalibrationResult:
    """Calibrate one machine, and write the calibration to a file.

    Args:
        options: Options of the command.
        file: File of the calibration.
        connect: Function that opens the machine.
        now: Wall-clock time; the current time if None.

    Raises:
        ConfigError: The rig or the stored file cannot be used, or the file is that of another real machine.
        IdentificationError: The machine is not as described.
        RigError: The envelope stopped the run.
    """
    start, now = time.perf_counter(), (now or datetime.now(UTC)).replace(microsecond=0)
    description = load_rig(options.rig, options.side)
    refuse_joints_without_motor(description)
    lengths = settings_of_lengths(description, options.lengths)
    refuse_other_than_calibration(file)
    motion = None if options.motion is None else read_empty_motion(options.motion, description)
    known = _known(options, description, lengths)
    make = calibration_command(options, file.parent if options.calibration is None else OUT)
    if options.recheck:
        read_calibration(file, make)  # A missing file is refused before any drive is opened.
    else:
        refuse_heavy_weights(description, adjusted(read_exoskeleton(description), description, lengths))
    with connect(description) as machine:
        refuse_to_replace(file, machine.serial)
        if options.recheck:
            before = take_calibration(file, description, machine.serial, now, make).whole
            calibration, t = machine.recheck(before.calibration(), before.measured.lengths_m)
            again = {"friction_at_utc": now, "running_s": round(t, 3)}
            measured = before.measured.model_copy(update=again)
        else:
            calibration, t = machine.calibrate(lengths, motion, known)
            measured = MeasurementConditions(
                at_utc=now, friction_at_utc=now, running_s=round(t, 3), lengths_m=dict(lengths)
            )
        serial, truth = machine.serial, machine.truth
    identity = identity_of(description, serial)
    whole = stored(calibration, identity, measured, description.joints)
    write_calibration(file, whole)
    t = measured.running_s
    true = None if truth is None else truth(t)
    return CalibrationResult(
        rig=description.name,
        side=description.side,
        disturbance_level=options.level,
        world=options.world,
        seed=options.seed,
        machine=identity.machine,
        figures=calibration_figures(calibration, description.joints, true),
        warnings=warnings(calibration, description)
        + ([] if known is None else twin_warnings(calibration, description, known)),
        hash=whole.content_sha256,
        file=file,
        measured_utc=measured.at_utc.isoformat(),
        friction_measured_utc=measured.friction_at_utc.isoformat(),
        simulated_s=round(t, 3),
        wall_s=round(time.perf_counter() - start, 2),
    )
