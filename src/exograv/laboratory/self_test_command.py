"""Self-test of the twin's empty machine for `exograv rig self-test`, and of the wearer's arm if requested."""

from dataclasses import dataclass
from pathlib import Path

from exograv.loop.pilot import Progress
from exograv.model.description import RigDescription
from exograv.procedures.self_test.bench import TestedMachine
from exograv.procedures.self_test.options import SelfTestOptions
from exograv.procedures.weighing.options import WeighOptions
from exograv.rig.twin import Disturbances, draw_machine
from exograv.storage.calibration_file import twin_identity
from exograv.storage.calibration_schema import StoredCalibration
from exograv.storage.self_test_step import Step, tried

from .twin_calibration import EmptyTwin
from .weighing_command import run_weighing

WORN = "arm weighing"


@dataclass(frozen=True)
class TwinUnderTest:
    """`MachineUnderTest` of these options: the twin."""

    options: SelfTestOptions
    calibration: Path
    description: RigDescription
    progress: Progress

    @property
    def serial(self) -> str:
        """Identity of the twin of this level and seed."""
        return twin_identity(self.options.level, self.options.seed, self.options.world)

    def hardware_steps(self) -> list[Step]:
        """Return no steps: the twin has no bus and no button."""
        return []

    def subject(self, whole: StoredCalibration) -> TestedMachine:
        """Return the machine of this level and seed, empty and hanging."""
        disturbances = Disturbances.at_level(self.options.level, self.options.world)
        machine = draw_machine(self.description, disturbances, self.options.seed)
        empty = EmptyTwin(self.description, machine, self.options.seed, whole.measured.lengths_m)
        return empty.under_test(whole.calibration())

    def worn_steps(self, steps: list[Step], /) -> list[Step]:
        """Weigh the arm against the form, if no step of the machine has failed."""
        if not all(step.passed or step.locks_only for step in steps):
            return [Step(WORN, None)]
        return tried(WORN, self._weigh)

    def _weigh(self) -> list[Step]:
        asked = self.options
        options = WeighOptions(
            rig=asked.rig, side=asked.side, level=asked.level, world=asked.world, seed=asked.seed, hand_weight_kg=0.0,
            body_mass_kg=asked.body_mass_kg, calibration=self.calibration,
        )  # fmt: skip
        found = run_weighing(options, self.progress)
        what_to_do = found.why if found.refused else ""
        return [Step(WORN, not found.refused, found.arm_mass_kg, "as the form says", "kg", what_to_do)]
