"""`exograv self-test`: the computer, the empty machine, and, if asked, the arm in it; what passes unlocks the day."""

import contextlib
import time
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ConfigError
from exograv.laboratory.twin_calibration import EmptyTwin, press_software_stop
from exograv.laboratory.weighing_command import WeighOptions, run_weighing
from exograv.live.on_drives.connection import Connected, DrivesAsked, Say, connected
from exograv.loop.pilot import Progress
from exograv.model.assembly import adjusted, read_exoskeleton
from exograv.model.description import RigDescription, Side, load_rig
from exograv.procedures.bring_up.bench_machine import BenchMachine
from exograv.procedures.bring_up.unpowered import stop_is_heard
from exograv.procedures.calibration.breakaway_checks import refuse_joints_without_motor
from exograv.procedures.self_test.bench import TestedMachine
from exograv.procedures.self_test.computer import clock, disk, recorder, timing
from exograv.procedures.self_test.unworn import test_machine
from exograv.rig import may_be_worn
from exograv.rig.twin import Disturbances, draw_machine
from exograv.storage.calibration_file import TakenCalibration, take_calibration, twin_identity
from exograv.storage.self_test_pass import FILE, NOT_NEEDED, MachineKey, withdraw_pass, write_pass
from exograv.storage.self_test_step import Step, tried

WORN = "arm weighing"


@dataclass(frozen=True)
class SelfTestOptions:
    """What `exograv self-test` is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    calibration: Path = Path("out/calibration.toml")
    worn: bool = False
    """Whether the arm in the machine is weighed too, after everything else has passed."""

    body_mass_kg: float | None = None
    """On the form; the wearer's own where absent."""

    drives: Path | None = None
    """drives.toml of a real machine; the twin is tested where it is absent and nothing simulated."""

    simulate: bool = False
    """Whether drives are simulated in another process."""

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if self.body_mass_kg is not None and not self.worn:
            raise ConfigError(f"--body-mass is {self.body_mass_kg:g} kg, and nobody is weighed: give --worn too.")
        if self.worn and self.is_on_drives:
            raise ConfigError("--worn is for the twin so far: leave it out with --drives or --simulate.")

    @property
    def is_on_drives(self) -> bool:
        """Whether the machine is reached over its bus."""
        return self.drives is not None or self.simulate


def run_self_test(
    options: SelfTestOptions, folder: Path, progress: Progress, say: Say = lambda _: None, now: datetime | None = None
) -> dict[str, Any]:
    """Run it; the result is what `exograv self-test --json` writes.

    Raises:
        ConfigError: The machine cannot be tested at all.
        RigError: A drive does not answer.
    """
    started, now = time.perf_counter(), now or datetime.now().astimezone()
    description = load_rig(options.rig, options.side)
    refuse_joints_without_motor(description)
    with contextlib.ExitStack() as stack:
        machine = None
        if options.is_on_drives:
            asked = DrivesAsked(options.drives, options.simulate, options.level, options.seed)
            machine = stack.enter_context(connected(asked, description, say, "A self-test"))
        serial = twin_identity(options.level, options.seed) if machine is None else machine.serial
        taken: list[TakenCalibration] = []
        steps = tried("hashes", lambda: hashes(options.calibration, description, serial, now, taken))
        for name, act in _of_computer(folder, description, progress):
            steps += tried(name, act)
        busy_s, note = 0.0, NOT_NEEDED
        if taken:
            if machine is not None:
                line = BenchMachine(machine.rig, machine.drives, machine.lock_step)
                steps += tried("hardware stop", lambda: stop_is_heard(line, machine.hands))
            subject = _subject(options, description, taken[0], machine)
            found, busy_s = test_machine(subject, progress)
            steps += found
            if options.worn:
                steps += _worn(options, steps, progress)
            key = MachineKey(folder / FILE, description, serial, taken[0].whole.content_sha256)
            note = _keep(options, key, subject, steps, now)
    return _figures(options, description, steps, note) | {
        "machine_s": round(busy_s, 3),
        "wall_s": round(time.perf_counter() - started, 2),
    }


def hashes(
    file: Path, description: RigDescription, serial: str, now: datetime, taken: list[TakenCalibration]
) -> list[Step]:
    """The files in force are those that the machine was calibrated with; the calibration goes into `taken`.

    Raises:
        ConfigError: They are not, or are damaged or too old.
    """
    taken.append(take_calibration(file, description, serial, now.astimezone(UTC)))
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


def _subject(
    options: SelfTestOptions, description: RigDescription, taken: TakenCalibration, connection: Connected | None
) -> TestedMachine:
    whole = taken.whole
    if connection is not None:
        tree = adjusted(read_exoskeleton(description), description, whole.measured.lengths_m)
        brake = np.array([drive.brake_Nms_per_rad for drive in connection.drives.each])
        known = whole.calibration()
        return TestedMachine(description, tree, known, connection.rig, press_software_stop, brake, connection.lock_step)
    machine = draw_machine(description, Disturbances.at_level(options.level), options.seed)
    return EmptyTwin(description, machine, options.seed, whole.measured.lengths_m).under_test(whole.calibration())


def _worn(options: SelfTestOptions, steps: list[Step], progress: Progress) -> list[Step]:
    """The arm is weighed against the form, when nothing of the machine has failed."""
    if not all(step.passed or step.locks_only for step in steps):
        return [Step(WORN, None)]

    def weigh() -> list[Step]:
        found = run_weighing(
            WeighOptions(
                options.rig,
                options.side,
                options.level,
                options.seed,
                hand_weight_kg=0.0,
                body_mass_kg=options.body_mass_kg,
                calibration=options.calibration,
            ),
            progress,
        )
        passed = not found["refused"]
        return [Step(WORN, passed, found["arm_mass_kg"], "as the form says", "kg", "" if passed else found["why"])]

    return tried(WORN, weigh)


def _keep(options: SelfTestOptions, key: MachineKey, subject: TestedMachine, steps: list[Step], now: datetime) -> str:
    """Unlock a real machine, or lock it; what to say of it."""
    if not may_be_worn(subject.rig):
        return NOT_NEEDED
    return keep(key, steps, options.worn, now, options.simulate)


def keep(key: MachineKey, steps: list[Step], worn: bool, now: datetime, is_simulated: bool = False) -> str:
    """Write the pass of a real machine whose every step has passed; withdraw an older one where one has not.

    Nobody can be in a simulated one, whose key opens no other: this computer need not be punctual for it.
    """
    failed = [step.name for step in steps if not (step.passed or (is_simulated and step.locks_only))]
    if failed:
        withdraw_pass(key.file, f"self-test failed: {failed[0]}")
        return f"locked: {failed[0]}"
    write_pass(key, now, worn)
    return f"passed at {now.replace(microsecond=0).isoformat()}"


def _figures(options: SelfTestOptions, description: RigDescription, steps: list[Step], note: str) -> dict[str, Any]:
    return {
        "rig": description.name,
        "side": description.side,
        "disturbance_level": options.level,
        "seed": options.seed,
        # What only locks worn mode says nothing of the machine, and no script on a twin needs to stop for it.
        "ok": all(step.passed or step.locks_only for step in steps),
        "may_be_worn": all(step.passed for step in steps),
        "self_test": note,
        "steps": [step.figures for step in steps],
    }
