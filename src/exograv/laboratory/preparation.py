"""All that has to happen before a wearer is weightless: the empty machine calibrated, the arm in it identified."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.calibration.empty_machine import Calibration
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits
from exograv.loop.pilot import Pilot, Progress
from exograv.procedures.identification.controller_knowledge import MOTION_S, ControllerKnowledge
from exograv.procedures.identification.estimator_session import table_guess
from exograv.procedures.identification.identify import Identifier, identify_arm
from exograv.procedures.identification.method_names import MethodName
from exograv.rig.twin import Twin
from exograv.safety.envelope import Envelope
from exograv.storage.calibration_file import take_calibration, twin_identity

from .twin_calibration import EmptyTwin
from .virtual_laboratory import VirtualLaboratory


def prepare(
    laboratory: VirtualLaboratory, seed: int, progress: Progress, method: MethodName = "recursive"
) -> ControllerKnowledge:
    """Calibrate and identify one machine and its wearer, by this method.

    Raises:
        ExogravError: The machine, the wearer or the run was refused.
    """
    known = prepare_machine(laboratory, seed, progress)
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, seed, t0=known.t)
    pilot = pilot_of(twin, known.machine.actuators, laboratory, progress)
    controller = ArmController(known.assembly, known.machine, known.x, twin.period_s)
    identifier = Identifier(pilot, controller, known.machine, method, "current", lambda *_found: None)
    found = identify_arm(pilot, controller, identifier, MOTION_S)
    return replace(known, x=found.last.x, t=twin.t)


def prepare_machine(laboratory: VirtualLaboratory, seed: int, progress: Progress) -> ControllerKnowledge:
    """Calibrate the machine; of its wearer only what the table says is known.

    Raises:
        ExogravError: The machine, the wearer or the run was refused.
    """
    calibration, t = _calibrated(laboratory, seed, progress)
    assembly, machine = laboratory.assembly(), calibration.machine
    return ControllerKnowledge(assembly, machine, table_guess(assembly, machine), t, calibration)


def machine_of(
    laboratory: VirtualLaboratory, level: int, seed: int, file: Path | None, progress: Progress
) -> tuple[CalibratedMachine, float]:
    """The machine by its stored calibration where there is a file, calibrated now without; and its clock then [s].

    Raises:
        ConfigError: The file is damaged, foreign or stale.
        ExogravError: The machine or the run was refused.
    """
    calibration, t = calibration_of(laboratory, level, seed, file, progress)
    return calibration.machine, t


def calibration_of(
    laboratory: VirtualLaboratory, level: int, seed: int, file: Path | None, progress: Progress
) -> tuple[Calibration, float]:
    """The same with all that a calibration says."""
    if file is None:
        return _calibrated(laboratory, seed, progress)
    taken = take_calibration(file, laboratory.description, twin_identity(level, seed), datetime.now(UTC))
    return taken.whole.calibration(), 0.0


def pilot_of(twin: Twin, actuators: ActuatorGain, laboratory: VirtualLaboratory, progress: Progress) -> Pilot:
    """Flies the twin without a recording."""
    return Pilot(twin, actuators, Envelope(limits(laboratory.description), twin.period_s), progress=progress)


def _calibrated(laboratory: VirtualLaboratory, seed: int, progress: Progress) -> tuple[Calibration, float]:
    """The empty machine, and its clock when it is known."""

    def pilot(twin: Twin, actuators: ActuatorGain) -> Pilot:
        return pilot_of(twin, actuators, laboratory, progress)

    empty = EmptyTwin(laboratory.description, laboratory.machine, seed, laboratory.wearer.lengths_given)
    return empty.calibrate(pilot)
