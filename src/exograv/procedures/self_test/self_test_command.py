"""`exograv rig self-test`: test the computer, the empty machine and, on request, the arm in it; unlock the machine."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Protocol

from exograv.loop.pilot import Progress
from exograv.model.description import RigDescription, load_rig
from exograv.next_command import calibration_command
from exograv.options import WorldName
from exograv.procedures.calibration.breakaway_checks import refuse_joints_without_motor
from exograv.rig import may_be_worn
from exograv.storage.calibration_file import MAKE, TakenCalibration, take_calibration
from exograv.storage.calibration_schema import StoredCalibration
from exograv.storage.self_test_pass import FILE, NOT_NEEDED, MachineKey, withdraw_pass, write_pass
from exograv.storage.self_test_step import Step, tried

from .bench import TestedMachine
from .computer import clock, disk, recorder, timing
from .machine_test import test_machine
from .options import SelfTestOptions


@dataclass(frozen=True)
class StepFigures:
    """Figures of a step in the result of a self-test."""

    name: str
    measured: float | str | None
    limit: float | str | None
    unit: str
    passed: bool | None
    what_to_do: str


@dataclass(frozen=True)
class SelfTestResult:
    """Result of a self-test."""

    rig: str
    side: str
    disturbance_level: int
    world: WorldName
    seed: int
    ok: bool
    """True if the machine has passed. Steps that only lock worn mode do not count."""
    may_be_worn: bool
    self_test: str
    """State of the lock."""
    steps: list[StepFigures]
    machine_s: float
    wall_s: float


class MachineUnderTest(Protocol):
    """Empty machine under test, real or simulated."""

    @property
    def serial(self) -> str:
        """Serial number, or identity of the twin."""
        ...

    def hardware_steps(self) -> list[Step]:
        """Return the steps that only a machine on drives has, before it is driven."""
        ...

    def subject(self, whole: StoredCalibration) -> TestedMachine:
        """Return the machine with its calibration, set to the lengths of that calibration."""
        ...

    def worn_steps(self, steps: list[Step], /) -> list[Step]:
        """Return the steps with the wearer in the machine, after the steps so far."""
        ...


def self_test_and_unlock(
    options: SelfTestOptions,
    folder: Path,
    progress: Progress,
    connect: Callable[[RigDescription], contextlib.AbstractContextManager[MachineUnderTest]],
    now: datetime | None = None,
) -> SelfTestResult:
    """Test one machine.

    Args:
        options: Options of the command.
        folder: Folder of the pass that unlocks the machine.
        progress: Called with the progress.
        connect: Function that opens the machine.
        now: Wall-clock time; the current time if None.

    Raises:
        ConfigError: The machine cannot be tested.
        RigError: A drive does not answer.
    """
    started, now = time.perf_counter(), now or datetime.now().astimezone()
    description = load_rig(options.rig, options.side)
    refuse_joints_without_motor(description)
    progress("Connecting to the machine", 0.0)
    with connect(description) as machine:
        taken: list[TakenCalibration] = []
        file, make = options.calibration_in(folder), calibration_command(options, folder)
        steps = tried("hashes", lambda: hashes(file, description, machine.serial, now, taken, make))
        for name, act in _of_computer(folder, description, progress):
            steps += tried(name, act)
        busy_s, note = 0.0, NOT_NEEDED if taken else "locked: hashes"
        if taken:
            steps += machine.hardware_steps()
            subject = machine.subject(taken[0].whole)
            found, busy_s = test_machine(subject, progress)
            steps += found
            if options.worn:
                steps += machine.worn_steps(steps)
            key = MachineKey(folder / FILE, description, machine.serial, taken[0].whole.content_sha256)
            if may_be_worn(subject.rig):
                note = keep(key, steps, options.worn, now, options.simulate)
    return SelfTestResult(
        rig=description.name,
        side=description.side,
        disturbance_level=options.level,
        world=options.world,
        seed=options.seed,
        ok=all(step.passed or step.locks_only for step in steps),
        may_be_worn=all(bool(step.passed) for step in steps),
        self_test=note,
        steps=[StepFigures(one.name, one.measured, one.limit, one.unit, one.passed, one.what_to_do) for one in steps],
        machine_s=round(busy_s, 3),
        wall_s=round(time.perf_counter() - started, 2),
    )


def hashes(
    file: Path, description: RigDescription, serial: str, now: datetime, taken: list[TakenCalibration], make: str = MAKE
) -> list[Step]:
    """Compare the hashes of the present files with those of the calibration, and append the calibration to `taken`.

    `make` is the command that calibrates this machine.

    Raises:
        ConfigError: A file differs, is damaged or is too old.
    """
    taken.append(take_calibration(file, description, serial, now.astimezone(UTC), make))
    seal = taken[0].whole.content_sha256
    return [
        Step("hash of rig.toml and URDF", True, description.sha256[:12], "as in the calibration"),
        Step("hash of the calibration", True, seal[:12], "as sealed", "", taken[0].warning or ""),
    ]


def _of_computer(
    folder: Path, description: RigDescription, progress: Progress
) -> list[tuple[str, Callable[[], list[Step]]]]:
    return [
        ("disk", lambda: disk(folder, len(description.joints))),
        ("clock", clock),
        ("recorder", lambda: recorder(folder, description.joints)),
        ("timing", lambda: timing(progress)),
    ]


def keep(key: MachineKey, steps: list[Step], worn: bool, now: datetime, is_simulated: bool = False) -> str:
    """Write the pass of a machine if every step has passed; otherwise withdraw an older pass.

    A simulated machine is exempt from steps that only lock: no person is in it, and its pass unlocks no other machine.
    """
    failed = [step.name for step in steps if not (step.passed or (is_simulated and step.locks_only))]
    if failed:
        withdraw_pass(key.file, f"self-test failed: {failed[0]}")
        return f"locked: {failed[0]}"
    write_pass(key, now, worn)
    return f"passed at {now.replace(microsecond=0).isoformat()}"
