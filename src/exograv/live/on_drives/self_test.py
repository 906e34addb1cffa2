"""`exograv self-test --drives`: the empty machine on its bus."""

import contextlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription
from exograv.procedures.bring_up.bench_machine import BenchMachine
from exograv.procedures.bring_up.unpowered_steps import stop_is_heard
from exograv.procedures.self_test.bench import TestedMachine, press_software_stop
from exograv.procedures.self_test.options import SelfTestOptions
from exograv.storage.calibration_schema import StoredCalibration
from exograv.storage.self_test_step import Step, tried

from .connection import Connected, Say, connected


@contextlib.contextmanager
def drives_under_test(options: SelfTestOptions, description: RigDescription, say: Say) -> Iterator["DrivesUnderTest"]:
    """Connect to the drives of an empty machine.

    Raises:
        ConfigError: The file of the drives cannot be used.
        RigError: A drive does not answer, or is not the one in the file.
    """
    with connected(options, description, say, "A self-test") as machine:
        yield DrivesUnderTest(description, machine)


@dataclass(frozen=True)
class DrivesUnderTest:
    """`MachineUnderTest` on its bus."""

    description: RigDescription
    machine: Connected

    @property
    def serial(self) -> str:
        """Of the drives."""
        return self.machine.serial

    def hardware_steps(self) -> list[Step]:
        """The hardware stop, which every drive has to see."""
        machine = self.machine
        line = BenchMachine(machine.rig, machine.drives, machine.lock_step)
        return tried("hardware stop", lambda: stop_is_heard(line, machine.hands))

    def subject(self, whole: StoredCalibration) -> TestedMachine:
        """The machine with its calibration; the drives brake as drives.toml says."""
        tree = adjusted(read_exoskeleton(self.description), self.description, whole.measured.lengths_m)
        brake = np.array([drive.brake_Nms_per_rad for drive in self.machine.drives.each])
        rig, known = self.machine.rig, whole.calibration()
        return TestedMachine(self.description, tree, known, rig, press_software_stop, brake, self.machine.lock_step)

    def worn_steps(self, _steps: list[Step], /) -> list[Step]:
        """None: `--worn` is refused on drives so far."""
        return []
