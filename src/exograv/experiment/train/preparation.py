"""Preparation before the first window: calibration and self-test of the empty machine, arm check, identification."""

from dataclasses import dataclass, field, replace
from datetime import UTC, datetime

import numpy as np
from pydantic import TypeAdapter

from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError, RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.identification.core.prior import prior
from exograv.laboratory.preparation import Preparation, unit_gains, worn_twin
from exograv.laboratory.twin_calibration import PilotOf
from exograv.laboratory.virtual_laboratory import VirtualLaboratory
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.output_feedback import Controller, NoTorque
from exograv.loop.phases import ARM_CHECK, LAYING_DOWN, Drive
from exograv.loop.pilot import Pilot, Progress
from exograv.loop.replay_log import read_machine
from exograv.model.assembly import Assembly
from exograv.next_command import calibration_command
from exograv.procedures.identification.controller_knowledge import MOTION_S, ControllerKnowledge
from exograv.procedures.identification.options import ParticipantOptions
from exograv.procedures.identification.participant_session import KeptParticipant, ParticipantRun
from exograv.procedures.identification.warm_start import FROM_FILE_S
from exograv.procedures.self_test.machine_test import test_machine
from exograv.procedures.weighing.arm_check import ArmCheck, ArmJudge, in_doubt_not_refused
from exograv.procedures.weighing.first_motion import first_motion
from exograv.procedures.weighing.motion_samples import SampleCollector
from exograv.recording.rounding import rounded
from exograv.results import OPTIONAL
from exograv.rig.twin import Twin
from exograv.rig.twin.world.surroundings import Surroundings
from exograv.storage.session_checkpoint import KnownPerson

from .options import TrainOptions


@dataclass(frozen=True)
class SelfTestPassed:
    """Self-test of the machine before the session."""

    passed: bool
    steps: int


@dataclass(frozen=True)
class ArmCheckFigures:
    """Mass of the arm compared with the form."""

    arm_mass_kg: float
    why: str
    probability: float


@dataclass(frozen=True)
class SessionIdentification:
    """Identification before the windows."""

    motion_s: float
    outcome: str
    from_file: bool
    predicted_left_over_Nm: list[float] | None


@dataclass(frozen=True)
class VerifiedBetween:
    """Verification between two windows."""

    after_windows: int
    left_over_Nm: list[float]
    ci95: list[list[float]]
    target_Nm: list[float]
    fingertip_mm: float
    fingertip_ci95_mm: list[float]
    relaxed: bool
    why: str
    motion_s: float


@dataclass(frozen=True)
class PreparationFigures:
    """Figures of the preparation. A machine that only records has none."""

    self_test: SelfTestPassed | None = field(default=None, metadata=OPTIONAL)
    arm_check: ArmCheckFigures | None = field(default=None, metadata=OPTIONAL)
    identification: SessionIdentification | None = field(default=None, metadata=OPTIONAL)
    person_kept: bool | None = field(default=None, metadata=OPTIONAL)
    verified: list[VerifiedBetween] | None = field(default=None, metadata=OPTIONAL)


PREPARATION: TypeAdapter[PreparationFigures] = TypeAdapter(PreparationFigures)
"""Reads the figures from a checkpoint."""


@dataclass
class Ready:
    """Machine with its participant, prepared for the windows."""

    pilot: Pilot
    twin: Twin
    controller: Controller
    person: KnownPerson | None = None
    figures: PreparationFigures = field(default_factory=PreparationFigures)
    model: ArmModel | None = None


def recording_only(
    laboratory: VirtualLaboratory, surroundings: Surroundings, day: int, pilot_of: PilotOf, t: float
) -> Ready:
    """Return a machine that gives no torque, because it has no motors or they are off."""
    twin = laboratory.twin(day, t, surroundings=surroundings)
    n = len(twin.joints)
    return Ready(pilot_of(twin, unit_gains(n)), twin, NoTorque(n))


def tested_machine(
    options: TrainOptions, laboratory: VirtualLaboratory, progress: Progress
) -> tuple[ControllerKnowledge, SelfTestPassed]:
    """Calibrate and self-test the empty machine. Return its controller's knowledge and the figures of the self-test.

    Raises:
        RigError: The self-test has failed.
        ExogravError: The calibration was refused, or the file is of another machine.
    """
    preparation = Preparation(laboratory, options.seed, progress)
    known = preparation.calibrated(options.calibration, make=calibration_command(options))
    steps, busy_s = test_machine(preparation.under_test(known), progress)
    failed = [step for step in steps if not (step.passed or step.locks_only)]
    if failed:
        raise RigError(
            f"The self-test has failed: {failed[0].name}. {failed[0].what_to_do} No person may be in this machine "
            "before "
            "`exograv rig self-test` passes."
        )
    return replace(known, t=known.t + busy_s), SelfTestPassed(True, len(steps))


def known_arm(
    options: TrainOptions,
    laboratory: VirtualLaboratory,
    surroundings: Surroundings,
    tested: tuple[ControllerKnowledge, SelfTestPassed],
    day: int,
    pilot_of: PilotOf,
) -> Ready:
    """Check the arm against the form for twenty seconds, identify it, then lay it on its support.

    Raises:
        ConfigError: The arm does not agree with the form, or with the participant's file.
        RigError: The envelope stopped the run.
    """
    known, passed = tested
    machine, assembly = known.machine, known.assembly
    worn = worn_twin(laboratory, known, day, pilot_of, surroundings)
    pilot, controller, twin = worn.pilot, worn.controller, worn.twin
    twin.put_surroundings(False)
    model = ArmModel(assembly, machine)
    judge, person = ArmJudge(model), person_run(options, laboratory, assembly)
    pilot.begin(ARM_CHECK)
    gentle = first_motion(pilot, controller, model)
    check = judge.judge([gentle], laboratory.body.mass_kg)
    if check.is_sure:
        _refuse_other_arm(check)
    identifier = worn.identifier(
        listener=lambda _t, estimate, predicted, _outcome: person.note(estimate, predicted),
        belief=person.belief(machine),
    )
    kept = SampleCollector()
    person.listen(identifier)
    identifier.followers.append(kept)
    found = worn.identify(identifier, MOTION_S if person.before is None else FROM_FILE_S)
    if not check.is_sure:
        both = judge.judge([gentle, kept.samples], laboratory.body.mass_kg)
        check = in_doubt_not_refused(both, found.restless_s is not None)
        _refuse_other_arm(check)
    written = person.keep(found, machine, "designed", "")
    lay_down(pilot, controller, twin)
    predicted = found.predicted[-1]
    figures = PreparationFigures(
        passed,
        ArmCheckFigures(round(check.arm_mass, 3), check.why, round(check.probability, 4)),
        SessionIdentification(
            motion_s=round(found.last.t, 3),
            outcome=found.outcome.value,
            from_file=person.before is not None,
            predicted_left_over_Nm=None if predicted is None else rounded(predicted),
        ),
        isinstance(written, KeptParticipant),
    )
    return Ready(pilot, twin, controller, _kept(machine, found.last), figures, identifier.model)


def known_again(
    laboratory: VirtualLaboratory,
    surroundings: Surroundings,
    person: KnownPerson,
    t: float,
    day: int,
    pilot_of: PilotOf,
) -> Ready:
    """Prepare the same arm after an interruption, from its stored parameters.

    Raises:
        RigError: The envelope stopped the run.
    """
    machine, x, assembly = read_machine(person.machine), np.array(person.x), laboratory.assembly()
    worn = worn_twin(laboratory, ControllerKnowledge(assembly, machine, x, t), day, pilot_of, surroundings)
    twin, pilot, controller = worn.twin, worn.pilot, worn.controller
    twin.put_surroundings(False)
    worn.limit_to_person(prior(assembly, machine)[0])
    controller.mode.drive = LAYING_DOWN.drive.goal(is_known=True)
    lay_down(pilot, controller, twin)
    return Ready(pilot, twin, controller, person, model=ArmModel(assembly, machine))


def lay_down(pilot: Pilot, controller: ArmController, twin: Twin) -> None:
    """Move the relaxed arm to its donning posture, bring screen and support, and return its weight to the wearer."""
    posture, dt = controller.assembly.description.donning_posture, twin.period_s
    pilot.begin(LAYING_DOWN)
    way = LAYING_DOWN.approach(pilot.q, posture, dt)
    pilot.run(controller, way, "Bringing the arm to its support")
    twin.put_surroundings(True)
    fade(pilot, controller, "drive", Drive.NEVER.goal(is_known=True), posture)
    fade(pilot, controller, "gravity_level", 1.0, posture)


def _kept(machine: CalibratedMachine, found: Estimate) -> KnownPerson:
    """Arm and machine for the checkpoint, from which an interrupted run continues."""
    covariance = np.zeros((0, 0)) if found.covariance is None else found.covariance
    return KnownPerson.of(machine, found.x, covariance)


def person_run(options: TrainOptions, laboratory: VirtualLaboratory, assembly: Assembly) -> ParticipantRun:
    """Read the person's file, if there is one.

    Raises:
        ConfigError: The file is damaged, belongs to another machine or person, or is of another kind.
    """
    file = options.person_file
    files = ParticipantOptions(
        keep=file,
        code=None if file is None else options.participant,
        participant=file if file is not None and file.exists() else None,
    )
    now = datetime.now(UTC).replace(microsecond=0)
    return ParticipantRun(files, assembly, laboratory.serial, laboratory.body, now, keep_option="--person-file")


def _refuse_other_arm(check: ArmCheck) -> None:
    if check.refused:
        raise ConfigError(f"{check.why} The training did not start.")
