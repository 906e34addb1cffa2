"""Recorded sample stream for every method: a relaxed arm, moved by a controller that does not learn."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.core.interface import RequestedMotion, Sample
from exograv.identification.core.sample_filter import SampleFilter
from exograv.laboratory.preparation import Preparation, WornTwin
from exograv.laboratory.twin_calibration import EmptyTwin, pilots
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.phases import IDENTIFICATION
from exograv.loop.pilot import Progress
from exograv.loop.tick_sample import TickSample
from exograv.model.assembly import Assembly
from exograv.procedures.identification.check_motion import PlannedCheck
from exograv.procedures.identification.identify import identification_motion, planned_check
from exograv.rig.twin import draw_machine

from .cases import Case
from .options import MOTION_S

DONNING_S = 300.0
"""Machine time between two wearers, in which the machine warms up [s]."""

Series = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class Samples:
    """Samples of a motion after the sample filter, one row per tick."""

    t: Float[np.ndarray, " sample"]
    """Motion time since the first sample [s]."""

    q: Series
    """Joint position [rad]."""

    v: Series
    """Joint velocity [rad/s]."""

    a: Series
    """Joint acceleration [rad/s²]."""

    tau: Series
    """Joint torque from the motor current [N·m]."""

    asked: Float[np.ndarray, "3 sample joint"]
    """Requested position, velocity and acceleration."""

    def __len__(self) -> int:
        return len(self.t)

    def __iter__(self) -> Iterator[Sample]:
        for k, t in enumerate(self.t.tolist()):
            yield Sample(t, self.q[k], self.v[k], self.a[k], self.tau[k], RequestedMotion(*self.asked[:, k]))


@dataclass(frozen=True)
class Stream:
    """Stream of samples and prior knowledge that a method may use."""

    assembly: Assembly
    machine: CalibratedMachine
    samples: Samples
    check: PlannedCheck | None = None
    """Check at the end of the motion; None if the motion is too short for one."""


@dataclass(frozen=True)
class RecordedStream:
    """Stream, with the truth that only the examiner may read."""

    case: Case
    stream: Stream
    laboratory: VirtualLaboratory


@dataclass(frozen=True)
class Calibrated:
    """Calibrated machine, ready for several wearers."""

    calibration: Calibration
    t: float
    """Time on the machine's clock after stage 0 [s]."""

    @property
    def machine(self) -> CalibratedMachine:
        """Machine with the parameters of its calibration."""
        return self.calibration.machine

    def worn(self, case: Case, laboratory: VirtualLaboratory, progress: Progress) -> WornTwin:
        """Put the wearer of this case into the machine at its present time. Only the arm from the table is known."""
        preparation = Preparation(laboratory, case.wearer_seed, progress)
        return preparation.worn(preparation.known(self.calibration, self.t + case.turn * DONNING_S))


def calibrate(case: Case, progress: Progress) -> Calibrated:
    """Calibrate the empty machine of a case at its nominal lengths, as `exograv rig calibrate` does.

    Raises:
        ExogravError: The machine was refused or stopped.
    """
    description = case.description
    machine = draw_machine(description, case.disturbances, case.machine_seed)
    lengths = {adjustment.segment: adjustment.nominal_m for adjustment in description.settings.adjustments}
    empty = EmptyTwin(description, machine, case.machine_seed, lengths)
    return Calibrated(*empty.calibrate(pilots(description, progress)))


def record_stream(case: Case, calibrated: Calibrated, progress: Progress, seconds: float = MOTION_S) -> RecordedStream:
    """Move the wearer's arm by feed-forward of the table's arm and a weak PD controller, without identification.

    Raises:
        ExogravError: The wearer does not fit into the machine, or the run was stopped.
    """
    laboratory = case.laboratory()
    worn = calibrated.worn(case, laboratory, progress)
    assembly, machine, pilot, controller = worn.known.assembly, worn.known.machine, worn.pilot, worn.controller
    controller.mode.drive = IDENTIFICATION.drive.goal(is_known=False)
    path = identification_motion(assembly, seconds, pilot.rig.period_s)
    pilot.run(controller, IDENTIFICATION.approach(pilot.q, path.q[0], path.dt), "Moving to the start")
    recorder = _Recorder(SampleFilter(assembly.n, path.dt))
    pilot.run(controller, path, "Recording the stream", recorder)
    return RecordedStream(
        case, Stream(assembly, machine, recorder.samples(), planned_check(assembly, seconds)), laboratory
    )


class _Recorder:
    """Listener that stores every settled sample of the motion."""

    def __init__(self, sample_filter: SampleFilter):
        self._filter = sample_filter
        self._t: list[float] = []
        self._rows: list[Float[np.ndarray, "7 joint"]] = []

    def __call__(self, moment: TickSample) -> None:
        sample = self._filter.update(moment.state.q, moment.tau_measured, moment.reference.q)
        asked = sample.asked
        if self._filter.settled and asked is not None:
            self._t.append(sample.t)
            self._rows.append(np.array([sample.q, sample.v, sample.a, sample.tau, asked.q, asked.v, asked.a]))

    def samples(self) -> Samples:
        """Return the stored samples."""
        q, v, a, tau, *asked = np.ascontiguousarray(np.array(self._rows).transpose(1, 0, 2))
        return Samples(np.array(self._t), q, v, a, tau, np.array(asked))
