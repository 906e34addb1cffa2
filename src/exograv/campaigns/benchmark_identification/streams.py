"""One stream of samples for every method: a relaxed arm moved by a controller that learns nothing."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv import motion
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.interface import RequestedMotion, Sample
from exograv.identification.core.sample_filter import SampleFilter
from exograv.laboratory.preparation import pilot_of
from exograv.laboratory.twin_calibration import EmptyTwin
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot, Progress, TickSample
from exograv.model.assembly import Assembly
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import TRAVEL, identification_motion
from exograv.rig.twin import Twin, draw_machine
from exograv.safety.envelope import Envelope

from .cases import Case

MOTION_S = 120.0
DONNING_S = 300.0
"""From one wearer to the next the machine runs on, and warms up [s]."""

Series = Float[np.ndarray, "sample joint"]


@dataclass(frozen=True)
class Samples:
    """A motion through the sample filter, one row a tick."""

    t: Float[np.ndarray, " sample"]
    """Seconds of motion since the first sample [s]."""

    q: Series
    """[rad]"""

    v: Series
    """[rad/s]"""

    a: Series
    """[rad/s²]"""

    tau: Series
    """By motor current [N·m]."""

    asked: Float[np.ndarray, "3 sample joint"]
    """Position, velocity and acceleration that were asked for."""

    def __len__(self) -> int:
        return len(self.t)

    def __iter__(self) -> Iterator[Sample]:
        for k, t in enumerate(self.t.tolist()):
            yield Sample(t, self.q[k], self.v[k], self.a[k], self.tau[k], RequestedMotion(*self.asked[:, k]))


@dataclass(frozen=True)
class Stream:
    """Everything that a method may know."""

    assembly: Assembly
    machine: CalibratedMachine
    samples: Samples


@dataclass(frozen=True)
class RecordedStream:
    """A stream, and apart from it what only the examiner may know."""

    case: Case
    stream: Stream
    laboratory: VirtualLaboratory


@dataclass(frozen=True)
class Calibrated:
    """A machine after stage 0, ready for several wearers."""

    machine: CalibratedMachine
    t: float
    """Its clock when stage 0 was done [s]."""

    def clock(self, case: Case) -> float:
        """The same when this wearer is in [s]."""
        return self.t + case.turn * DONNING_S


def calibrate(case: Case, progress: Progress) -> Calibrated:
    """Stage 0 on the empty machine of a case, at its nominal lengths, as `exograv calibrate` does.

    Raises:
        ExogravError: The machine was refused or stopped.
    """
    description = case.description
    machine = draw_machine(description, case.disturbances, case.machine_seed)
    lengths = {adjustment.segment: adjustment.nominal_m for adjustment in description.settings.adjustments}

    def pilot(twin: Twin, actuators: ActuatorGain) -> Pilot:
        return Pilot(twin, actuators, Envelope(limits(description), twin.period_s), progress=progress)

    calibration, t = EmptyTwin(description, machine, case.machine_seed, lengths).calibrate(pilot)
    return Calibrated(calibration.machine, t)


def record_stream(case: Case, calibrated: Calibrated, progress: Progress, seconds: float = MOTION_S) -> RecordedStream:
    """Move the wearer's arm by feed-forward of the table's arm and weak PD; nothing is learned meanwhile.

    Raises:
        ExogravError: The wearer does not fit into the machine, or the run was stopped.
    """
    laboratory = case.laboratory()
    assembly, machine = laboratory.assembly(), calibrated.machine
    twin = worn_twin(case, laboratory, calibrated)
    pilot = pilot_of(twin, machine.actuators, laboratory, progress)
    controller = ArmController(assembly, machine, table_guess(assembly, machine), twin.period_s)
    controller.mode.drive = 1.0
    path = identification_motion(assembly, seconds, twin.period_s)
    approach = [motion.go_to(pilot.q, path.q[0], TRAVEL, path.dt), motion.hold(path.q[0], 0.5, path.dt)]
    pilot.run(controller, motion.joined(approach), "Moving to the start")
    recorder = _Recorder(SampleFilter(assembly.n, twin.period_s))
    pilot.run(controller, path, "Recording the stream", recorder)
    return RecordedStream(case, Stream(assembly, machine, recorder.samples()), laboratory)


def worn_twin(case: Case, laboratory: VirtualLaboratory, calibrated: Calibrated) -> Twin:
    """The machine with the wearer in it, at the time on its clock."""
    return Twin(
        laboratory.description, laboratory.machine, laboratory.wearer, case.wearer_seed, t0=calibrated.clock(case)
    )


class _Recorder:
    """Listens to the motion and keeps every settled sample."""

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
        """All that was kept."""
        q, v, a, tau, *asked = np.ascontiguousarray(np.array(self._rows).transpose(1, 0, 2))
        return Samples(np.array(self._t), q, v, a, tau, np.array(asked))
