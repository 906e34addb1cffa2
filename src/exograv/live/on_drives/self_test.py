"""Self-test of the empty machine on its bus (`exograv rig self-test --drives`)."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.procedures.bring_up.bench_machine import BenchMachine
from exograv.procedures.bring_up.unpowered_steps import stop_is_heard
from exograv.procedures.self_test.bench import TestedMachine, press_software_stop
from exograv.procedures.self_test.options import SelfTestOptions
from exograv.storage.calibration_schema import StoredCalibration
from exograv.storage.self_test_step import Step, tried

from .connection import Connected, Say, connected, not_ready


@contextlib.contextmanager
def drives_under_test(
    options: SelfTestOptions, folder: Path, description: RigDescription, say: Say
) -> Iterator["DrivesUnderTest"]:
    """Connect to the drives of an empty machine, which must have been brought up and calibrated.

    Raises:
        ConfigError: The file of the drives, the sheet or the calibration cannot be used.
        RigError: A drive does not answer, or is not the drive in the file.
    """
    refuse = not_ready(options, folder, description, "rig self-test", say)
    with connected(options, description, say, "A self-test", refuse) as machine:
        yield DrivesUnderTest(description, machine)


@dataclass(frozen=True)
class DrivesUnderTest:
    """Empty machine on its bus; a `MachineUnderTest`."""

    description: RigDescription
    machine: Connected

    @property
    def serial(self) -> str:
        """Serial number of the drives."""
        return self.machine.serial

    def hardware_steps(self) -> list[Step]:
        """Test the hardware stop: every drive must see it."""
        machine = self.machine
        line = BenchMachine(machine.rig, machine.drives, machine.lock_step)
        return tried("hardware stop", lambda: stop_is_heard(line, machine.hands))

    def subject(self, whole: StoredCalibration) -> TestedMachine:
        """Return the machine with its calibration, and the braking of its drives from drives.toml."""
        tree = adjusted(read_exoskeleton(self.description), self.description, whole.measured.lengths_m)
        brake = np.array([drive.brake_Nms_per_rad for drive in self.machine.drives.each])
        rig, known = self.machine.rig, whole.calibration()
        return TestedMachine(self.description, tree, known, rig, press_software_stop, brake, self.machine.lock_step)

    def worn_steps(self, _steps: list[Step], /) -> list[Step]:
        """Return no steps: `--worn` is not supported on drives."""
        return []
