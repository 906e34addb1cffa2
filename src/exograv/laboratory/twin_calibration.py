"""Calibration of the twin's empty machine, and the check of its friction."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from exograv.dynamics.actuator import ActuatorGain
from exograv.identification.calibration.empty_machine import GAIN_SD, Calibration
from exograv.identification.calibration.empty_prior import EmptyPrior
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot, Progress
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.rig_settings import Excitation
from exograv.model.tree import Tree
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.procedures.calibration.calibrate import calibrate_machine, recheck_machine
from exograv.procedures.calibration.operator import ComputedOperator
from exograv.procedures.self_test.bench import TestedMachine, press_software_stop
from exograv.recording import RecordingWriter
from exograv.rig.twin import Machine, Twin
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.envelope import Envelope

PilotOf = Callable[[Twin, ActuatorGain], Pilot]
"""Function that builds the pilot of a twin whose motors have these torque gains."""


def pilots(
    description: RigDescription,
    progress: Progress,
    recording: RecordingWriter | None = None,
    is_realtime: bool = False,
) -> PilotOf:
    """Return a function that makes pilots behind the machine's own limits; without `recording` nothing is written."""

    def pilot_of(twin: Twin, actuators: ActuatorGain) -> Pilot:
        pace = RealTimePace(twin.period_s) if is_realtime else None
        return Pilot(twin, actuators, Envelope(limits(description), twin.period_s), recording, progress, pace)

    return pilot_of


@dataclass(frozen=True)
class EmptyTwin:
    """The twin's machine without a wearer."""

    description: RigDescription
    machine: Machine
    seed: int
    lengths: Mapping[str, float]
    """Adjustable lengths by segment [m]."""

    def calibrate(
        self, pilot_of: PilotOf, motion: Excitation | None = None, known: EmptyPrior | None = None
    ) -> tuple[Calibration, float]:
        """Calibrate from cold, with a further motion if one is given; return the result and the rig's clock [s]."""
        tree, nominal = self._tree(), self.description.nominal_gain
        twin = self._hanging(tree)
        pilot = pilot_of(twin, ActuatorGain(nominal, GAIN_SD * nominal))
        pilot.begin("calibrate")
        operator = ComputedOperator(twin.hang)
        return calibrate_machine(self.description, tree, pilot, operator, motion, known), twin.t

    def recheck(self, before: Calibration, pilot_of: PilotOf) -> tuple[Calibration, float]:
        """Measure friction again from cold, all else as `before`; return the result and the rig's clock [s]."""
        tree = self._tree()
        twin = self._hanging(tree)
        pilot = pilot_of(twin, before.machine.actuators)
        pilot.begin("recheck")
        return recheck_machine(self.description, tree, pilot, before), twin.t

    def under_test(self, calibration: Calibration) -> TestedMachine:
        """Return the hanging machine for its self-test, with a virtual operator who presses Stop when it is time."""
        tree = self._tree()
        return TestedMachine(self.description, tree, calibration, self._hanging(tree), press_software_stop)

    def _tree(self) -> Tree:
        return adjusted(read_exoskeleton(self.description), self.description, self.lengths)

    def _hanging(self, tree: Tree) -> Twin:
        start = starting_posture(tree)
        return Twin(self.description, self.machine, None, self.seed, start, lengths=self.lengths)
