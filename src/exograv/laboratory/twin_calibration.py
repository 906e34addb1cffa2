"""Stage 0 on the twin: the empty machine of a virtual laboratory is calibrated, or its friction checked again."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from exograv.dynamics.actuator import ActuatorGain
from exograv.identification.calibration.empty_machine import GAIN_SD, Calibration
from exograv.loop.pilot import Pilot
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.model.tree import Tree
from exograv.procedures.calibration.breakaway_test import starting_posture
from exograv.procedures.calibration.calibrate import calibrate_machine, recheck_machine
from exograv.procedures.calibration.operator import ComputedOperator
from exograv.procedures.self_test.bench import TestedMachine
from exograv.rig.twin import Machine, Twin
from exograv.safety.guard import Guard

PilotOf = Callable[[Twin, ActuatorGain], Pilot]


@dataclass(frozen=True)
class EmptyTwin:
    """A machine of the twin without a wearer."""

    description: RigDescription
    machine: Machine
    seed: int
    lengths: Mapping[str, float]
    """What it is set to, by segment [m]."""

    def calibrate(self, pilot_of: PilotOf) -> tuple[Calibration, float]:
        """From cold; the result, and the rig's clock when it is done [s]."""
        tree, nominal = self._tree(), self.description.nominal_gain
        twin = self._hanging(tree)
        pilot = pilot_of(twin, ActuatorGain(nominal, GAIN_SD * nominal))
        pilot.begin("calibrate")
        return calibrate_machine(self.description, tree, pilot, ComputedOperator(twin.hang)), twin.t

    def recheck(self, before: Calibration, pilot_of: PilotOf) -> tuple[Calibration, float]:
        """Friction anew and all else as `before`, from cold; the result, and the rig's clock when it is done [s]."""
        tree = self._tree()
        twin = self._hanging(tree)
        pilot = pilot_of(twin, before.machine.actuators)
        pilot.begin("recheck")
        return recheck_machine(self.description, tree, pilot, before), twin.t

    def _tree(self) -> Tree:
        return adjusted(read_exoskeleton(self.description), self.description, self.lengths)

    def _hanging(self, tree: Tree) -> Twin:
        start = starting_posture(tree)
        return Twin(self.description, self.machine, None, self.seed, start, lengths=self.lengths)


def virtual_subject(
    description: RigDescription, machine: Machine, calibration: Calibration, lengths: Mapping[str, float], seed: int
) -> TestedMachine:
    """The empty machine of the twin, hanging, and somebody who presses Stop when it is time."""
    tree = adjusted(read_exoskeleton(description), description, lengths)
    twin = Twin(description, machine, None, seed, starting_posture(tree), lengths=lengths)
    return TestedMachine(description, tree, calibration, twin, press_software_stop)


def press_software_stop(guard: Guard) -> None:
    """As Ctrl-C, or a button on a screen; the hardware stop of drives has a step of its own."""
    guard.press_stop()
