"""The choice between a real machine and the twin.

Only this module loads the twin for a command that may also run on drives: a computer with a real machine needs no
MuJoCo. Nor does a computer with simulated drives in another process; it then has no truth to compare with.
"""

import importlib.util
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from exograv.live.live_flight import LiveOptions
    from exograv.live.live_processes import Running
    from exograv.live.on_drives.connection import DrivesAsked, Say
    from exograv.loop.pilot import Progress
    from exograv.model.description import RigDescription
    from exograv.options import Side
    from exograv.procedures.calibration.calibrate_command import CalibrateOptions, EmptyMachine, TruthAt
    from exograv.procedures.identification.simulated_wearer import SimulatedWearer
    from exograv.procedures.self_test.self_test_command import MachineUnderTest, SelfTestOptions
    from exograv.procedures.verification.options import VerifyOptions


def is_twin_installed() -> bool:
    """True if MuJoCo, the engine of the twin, can be imported here."""
    return importlib.util.find_spec("mujoco") is not None


def simulated_wearer(asked: "DrivesAsked", rig: str, side: "Side | None") -> "SimulatedWearer | None":
    """The wearer of simulated drives, drawn as the process of the drives draws it.

    None for a real machine, and where the twin is not installed.
    """
    if not (asked.simulate and is_twin_installed()):
        return None
    from exograv.laboratory.truth_score import ScoredWearer
    from exograv.laboratory.virtual_laboratory import draw_laboratory

    return ScoredWearer(draw_laboratory(rig, side, asked.level, asked.seed))


def run_calibration(
    options: "CalibrateOptions", progress: "Progress", say: "Say" = lambda _: None, now: datetime | None = None
) -> dict[str, Any]:
    """Calibrate the machine of these options; see `calibrate_and_keep`."""
    from exograv.procedures.calibration.calibrate_command import calibrate_and_keep

    def connect(description: "RigDescription") -> "AbstractContextManager[EmptyMachine]":
        if options.is_on_drives:
            from exograv.live.on_drives.calibration import empty_drives

            return empty_drives(options, description, _truth(options, description), progress, say)
        from exograv.laboratory.calibration_command import EmptyTwinMachine

        return nullcontext(EmptyTwinMachine(options, description, progress))

    return calibrate_and_keep(options, connect, now)


def _truth(options: "CalibrateOptions", description: "RigDescription") -> "TruthAt | None":
    if not (options.simulate and is_twin_installed()):
        return None
    from exograv.laboratory.calibration_command import truth_of_machine

    return truth_of_machine(description, options.level, options.seed)


def run_self_test(
    options: "SelfTestOptions",
    folder: Path,
    progress: "Progress",
    say: "Say" = lambda _: None,
    now: datetime | None = None,
) -> dict[str, Any]:
    """Test the machine of these options; see `self_test_and_unlock`."""
    from exograv.procedures.self_test.self_test_command import self_test_and_unlock

    def connect(description: "RigDescription") -> "AbstractContextManager[MachineUnderTest]":
        if options.is_on_drives:
            from exograv.live.on_drives.self_test import drives_under_test

            return drives_under_test(options, description, say)
        from exograv.laboratory.self_test_command import TwinUnderTest

        return nullcontext(TwinUnderTest(options, description, progress))

    return self_test_and_unlock(options, folder, progress, connect, now)


def run_live(
    options: "LiveOptions", folder: Path, progress: "Progress", started: "Callable[[Running], object]" = lambda *_: None
) -> dict[str, Any]:
    """Float the arm of the twin in real time; see `run_live_simulated`."""
    from exograv.laboratory.live_twin import prepare_live_twin
    from exograv.live.simulated_run import run_live_simulated

    return run_live_simulated(
        options,
        lambda: prepare_live_twin(
            options.rig, options.side, options.level, options.seed, not options.identify_s, options.self_test, progress
        ),
        folder,
        progress,
        started,
    )


def run_verification(options: "VerifyOptions", progress: "Progress") -> dict[str, Any]:
    """Verify on the twin."""
    from exograv.laboratory.verification_command import run_verification

    return run_verification(options, progress)
