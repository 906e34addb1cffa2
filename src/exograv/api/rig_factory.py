"""Choice between a real machine and the twin.

Only this module loads the twin for a command that may also run on drives: a computer with a real machine needs no
MuJoCo. A computer with simulated drives in another process needs no MuJoCo either; its results then have no truth.
"""

import importlib.util
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from exograv.experiment.steered.interface import SteeredFlight
    from exograv.experiment.steered.options import SteeredOptions
    from exograv.laboratory.demo_result import DemoResult
    from exograv.laboratory.options import ArmOptions
    from exograv.live.live_figures import LiveFigures
    from exograv.live.live_processes import Running
    from exograv.live.on_drives.connection import Say
    from exograv.live.on_drives.identification import IdentifiedOnDrives
    from exograv.live.options import LiveOptions, PersonForm, ReturningPerson
    from exograv.loop.pilot import Progress
    from exograv.model.description import RigDescription
    from exograv.options import MachineOptions
    from exograv.procedures.calibration.calibrate_command import CalibrationResult, EmptyMachine, TruthAt
    from exograv.procedures.calibration.options import CalibrateOptions
    from exograv.procedures.identification.options import ParticipantOptions
    from exograv.procedures.identification.simulated_wearer import SimulatedWearer
    from exograv.procedures.self_test.options import SelfTestOptions
    from exograv.procedures.self_test.self_test_command import MachineUnderTest, SelfTestResult
    from exograv.procedures.verification.figures import VerifyResult
    from exograv.procedures.verification.options import VerifyOptions


def is_twin_installed() -> bool:
    """Return True if MuJoCo, the engine of the twin, is installed."""
    return importlib.util.find_spec("mujoco") is not None


def simulated_wearer(options: "MachineOptions") -> "SimulatedWearer | None":
    """Draw the wearer of simulated drives from the same seed as the process of the drives.

    None for a real machine, and if the twin is not installed.
    """
    if not (options.simulate and is_twin_installed()):
        return None
    from exograv.laboratory.truth_score import ScoredWearer
    from exograv.laboratory.virtual_laboratory import draw_laboratory, with_twin
    from exograv.rig.twin import Disturbances

    drawn = draw_laboratory(options.rig, options.side, options.level, options.seed, world=options.world)
    disturbances = Disturbances.at_level(options.level, options.world)
    return ScoredWearer(with_twin(drawn, options.twin, disturbances, options.seed))


def run_calibration(
    options: "CalibrateOptions",
    folder: Path,
    progress: "Progress",
    say: "Say" = lambda _: None,
    now: datetime | None = None,
) -> "CalibrationResult":
    """Calibrate the machine of these options; see `calibrate_and_keep`."""
    from exograv.procedures.calibration.calibrate_command import calibrate_and_keep

    file = options.calibration_in(folder)

    def connect(description: "RigDescription") -> "AbstractContextManager[EmptyMachine]":
        if options.is_on_drives:
            from exograv.live.on_drives.calibration import empty_drives

            return empty_drives(options, folder, description, _truth(options, description), progress, say)
        from exograv.laboratory.calibration_command import EmptyTwinMachine

        return nullcontext(EmptyTwinMachine(options, description, progress))

    return calibrate_and_keep(options, file, connect, now)


def _truth(options: "CalibrateOptions", description: "RigDescription") -> "TruthAt | None":
    if not (options.simulate and is_twin_installed()):
        return None
    from exograv.laboratory.calibration_command import truth_of_machine

    return truth_of_machine(description, options.level, options.seed, options.world, options.twin)


def run_self_test(
    options: "SelfTestOptions",
    folder: Path,
    progress: "Progress",
    say: "Say" = lambda _: None,
    now: datetime | None = None,
) -> "SelfTestResult":
    """Test the machine of these options; see `self_test_and_unlock`."""
    from exograv.procedures.self_test.self_test_command import self_test_and_unlock

    def connect(description: "RigDescription") -> "AbstractContextManager[MachineUnderTest]":
        if options.is_on_drives:
            from exograv.live.on_drives.self_test import drives_under_test

            return drives_under_test(options, folder, description, say)
        from exograv.laboratory.self_test_command import TwinUnderTest

        return nullcontext(TwinUnderTest(options, options.calibration_in(folder), description, progress))

    return self_test_and_unlock(options, folder, progress, connect, now)


def run_live(
    options: "LiveOptions", folder: Path, progress: "Progress", started: "Callable[[Running], object]" = lambda *_: None
) -> "LiveFigures":
    """Float the arm of the twin in real time; see `run_live_simulated`."""
    from exograv.laboratory.live_twin import prepare_live_twin
    from exograv.live.simulated_run import run_live_simulated

    return run_live_simulated(
        options,
        lambda: prepare_live_twin(options, not options.identify_s, options.self_test, progress),
        folder,
        progress,
        started,
    )


def run_verification(
    options: "VerifyOptions", person: "ReturningPerson", folder: Path, progress: "Progress", say: "Say"
) -> "VerifyResult":
    """Identify an arm, and measure the torque left over of its weight."""
    if options.is_on_drives:
        from exograv.live.on_drives.verification import run_verification_on_drives

        return run_verification_on_drives(options, person, folder, progress, say, simulated_wearer(options))
    from exograv.laboratory.verification_command import run_verification

    return run_verification(options, progress)


def steered_flight(
    options: "SteeredOptions", person: "PersonForm", folder: Path, command: str, say: "Say"
) -> "SteeredFlight":
    """Return the flight of a steered session on the twin or on drives. `command` asks for the machine.

    Raises:
        ExogravError: The machine is not ready, or a file or an option cannot be used.
    """
    from exograv.experiment.steered.live_session import LiveFlight

    if options.is_on_drives:
        from exograv.experiment.steered.driven_machine import DrivenMachine, machine_of_side

        machine = DrivenMachine(options, person, folder, command, say, simulated_wearer(options))
        return LiveFlight(options, folder, machine_of_side(machine))
    from exograv.experiment.steered.prepared_machine import PreparedMachine

    return LiveFlight(options, folder, lambda side: PreparedMachine(options, side))


def run_identification(
    options: "ArmOptions",
    files: "ParticipantOptions",
    person: "PersonForm",
    folder: Path,
    progress: "Progress",
    say: "Say",
) -> "DemoResult | IdentifiedOnDrives":
    """Identify an arm, and keep it in a file if one is named."""
    if options.is_on_drives:
        from exograv.live.on_drives.identification import identify_on_drives

        wearer = simulated_wearer(options)
        return identify_on_drives(options, options.seconds, files, person, folder, progress, say, wearer)
    from exograv.laboratory.demo import run_demo
    from exograv.laboratory.options import DemoOptions

    return run_demo(DemoOptions(**vars(options.on_twin), only_identify=True), folder, progress, files)
