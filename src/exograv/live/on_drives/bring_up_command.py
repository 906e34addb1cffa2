"""Bring-up of a machine (`exograv rig test`): steps in order of danger. None is optional; the first failure ends it."""

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from pathlib import Path

from exograv.live.options import RigTestOptions
from exograv.loop.pilot import Progress
from exograv.model.assembly import read_exoskeleton
from exograv.model.description import RigDescription, load_rig
from exograv.procedures.bring_up.bench_machine import BenchMachine
from exograv.procedures.bring_up.hands import Hands
from exograv.procedures.bring_up.powered_steps import PoweredSteps
from exograv.procedures.bring_up.unpowered_steps import stop_is_heard, turns, watchdog, wiring, zero_torque
from exograv.procedures.calibration.breakaway_checks import refuse_joints_without_motor
from exograv.rig.drives.opening import DrivenRig, open_drives
from exograv.rig.drives.settings import Drives
from exograv.storage.bring_up_sheet import FILE, BringUpSheet, write_sheet
from exograv.storage.self_test_step import Step, tried

from .connection import CONNECTING, Say, drives_with_hands

Act = Callable[[], list[Step]]


@dataclass(frozen=True)
class BringUpStep:
    """Step in the result of a bring-up."""

    name: str
    passed: bool | None
    value: float | str | None
    limit: float | str | None
    unit: str
    what_to_do: str

    @property
    def measured(self) -> float | str | None:
        """Measured value, under the name that steps of the self-test use."""
        return self.value


@dataclass(frozen=True)
class BringUpResult:
    """Result of a bring-up."""

    rig: str
    serial: str
    by: str
    simulated: bool
    ok: bool
    passed: bool
    may_be_worn: bool
    steps: list[BringUpStep]
    sheet: Path
    sha256: str


def run_rig_test(options: RigTestOptions, folder: Path, progress: Progress, say: Say) -> BringUpResult:
    """Bring up a machine and write the sheet of the bring-up.

    Raises:
        ConfigError: A file or an option cannot be used.
        RigError: The simulated drives do not start.
    """
    description = load_rig(options.rig, options.side)
    refuse_joints_without_motor(description)
    walk = BringUpWalk()
    progress(CONNECTING, 0.0)
    with drives_with_hands(options, description, say, "A bring-up", options.simulation) as (drives, hands):

        def seal(interrupted_at: str = "") -> BringUpSheet:
            now = datetime.now().astimezone()
            return write_sheet(
                folder / FILE, description, drives, walk.steps, options.by, now, options.simulate, interrupted_at
            )

        try:
            walk.run(description, drives, hands, progress, options.simulate)
        except KeyboardInterrupt:
            seal(walk.at)
            say(f"The bring-up was interrupted at the step “{walk.at}”, and {folder / FILE} says so. No step failed.")
            raise
        sheet = seal()
    steps = walk.steps
    return BringUpResult(
        rig=description.name,
        serial=drives.settings.serial,
        by=options.by,
        simulated=options.simulate,
        ok=sheet.done.passed,
        passed=sheet.done.passed,
        may_be_worn=not drives.without_brake,
        steps=[BringUpStep(one.name, one.passed, one.measured, one.limit, one.unit, one.what_to_do) for one in steps],
        sheet=folder / FILE,
        sha256=sheet.content_sha256,
    )


class BringUpWalk:
    """Walk through all steps of a bring-up. It keeps its results when it is interrupted."""

    def __init__(self) -> None:
        self.steps: list[Step] = []
        """Results so far."""
        self.at = "files"
        """Name of the present step."""

    def run(
        self, description: RigDescription, drives: Drives, hands: Hands, progress: Progress, lock_step: bool
    ) -> None:
        """Run all steps. Steps after a failed step are listed but not tried."""
        limits = description.per_actuator("torque_max_Nm")
        self.steps += wiring(drives, limits, description.nominal_gain)
        if _failed(self.steps):
            self.steps.append(Step("everything after that", None))
            return
        with contextlib.ExitStack() as stack:
            opened: list[DrivenRig] = []

            def connect() -> list[Step]:
                opened.append(stack.enter_context(open_drives(drives, lock_step)))
                n = str(len(drives.joints))
                return [Step(self.at, True, n, n, "drives")]

            self._try("every drive answers, and is the one in drives.toml", connect)
            acts = _acts(description, drives, opened[0], hands, progress, lock_step) if opened else []
            for number, (name, act) in enumerate(acts):
                progress(name, number / len(acts))
                if _failed(self.steps):
                    self.steps.append(Step(name, None))
                else:
                    self._try(name, act)
            if not opened:
                self.steps.append(Step("everything after that", None))

    def _try(self, name: str, act: Act) -> None:
        self.at = name
        self.steps += tried(name, act)


def _failed(steps: list[Step]) -> bool:
    return any(not (step.passed or step.locks_only) for step in steps)


def _acts(
    description: RigDescription, drives: Drives, rig: DrivenRig, hands: Hands, progress: Progress, lock_step: bool
) -> list[tuple[str, Act]]:
    """Name and action of each step, the least dangerous first."""
    line, joints = BenchMachine(rig, drives, lock_step), description.joints
    moving: list[PoweredSteps] = []

    def powered() -> PoweredSteps:
        if not moving:
            moving.append(PoweredSteps(description, read_exoskeleton(description), line, drives, hands, progress))
        return moving[0]

    def leads(joint: int) -> list[Step]:
        return powered().leads(joint)

    def weighs(joint: int) -> list[Step]:
        return powered().weighs(joint)

    return [
        *((f"{name}: encoder, turned by hand", partial(turns, line, hands, j)) for j, name in enumerate(joints)),
        ("hardware stop is seen by every drive", lambda: stop_is_heard(line, hands)),
        ("no torque when none is asked for", lambda: zero_torque(line)),
        ("watchdog at no torque", lambda: watchdog(line, drives, "watchdog at no torque")),
        ("nudges", lambda: powered().nudges()),
        *((f"{name}: follows a slow motion", partial(leads, j)) for j, name in enumerate(joints)),
        ("hardware stop under torque", lambda: powered().stops()),
        ("watchdog under torque", lambda: powered().falls_silent()),
        *((f"{name}: weighs a known weight", partial(weighs, j)) for j, name in enumerate(joints)),
    ]
