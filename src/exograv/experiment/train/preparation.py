"""Preparation before the first window: arm check, identification, and laying the arm on its support."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter

from exograv.dynamics.machine import CalibratedMachine
from exograv.errors import ConfigError
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.identification.core.muscle_signals import MuscleSignals
from exograv.identification.core.prior import prior
from exograv.loop.arm_controller import ArmController
from exograv.loop.mode_ramp import fade
from exograv.loop.output_feedback import Controller
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.phases import ARM_CHECK, LAYING_DOWN, Drive
from exograv.loop.pilot import Pilot
from exograv.loop.replay_log import read_machine
from exograv.model.anthropometry import Body
from exograv.model.assembly import Assembly
from exograv.procedures.identification.carried_figures import CarriedFigures
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import arm_to_carry
from exograv.procedures.identification.identify import Identifier, identify_arm
from exograv.procedures.identification.muscle_source import MuscleSource
from exograv.procedures.identification.options import NO_FILES, ParticipantOptions
from exograv.procedures.identification.participant_session import KeptParticipant, ParticipantRun
from exograv.procedures.identification.rest_learning import RestLearner
from exograv.procedures.identification.session_watch import SessionWatch
from exograv.procedures.identification.warm_start import WarmStart
from exograv.procedures.weighing.arm_check import ArmCheck, ArmJudge, in_doubt_not_refused
from exograv.procedures.weighing.first_motion import first_motion
from exograv.procedures.weighing.motion_samples import SampleCollector
from exograv.recording.rounding import rounded
from exograv.results import OPTIONAL
from exograv.storage.session_checkpoint import KeptRests, KnownPerson


@dataclass(frozen=True)
class SelfTestPassed:
    """Self-test of the machine before the session."""

    passed: bool
    steps: int | None = field(default=None, metadata=OPTIONAL)
    """Number of its steps; None if it was passed before this command."""


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
    why: str = ""
    """Figures behind the outcome and the decision to float."""
    carried: CarriedFigures | None = None
    """Decision to float; None in checkpoints of earlier versions."""


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
class SlowChangeFigures:
    """Change that a check between two windows has found."""

    kind: str
    place: str
    size: float
    """Size in metres, newton metres or as a share."""
    half_width: float
    probability: float


@dataclass(frozen=True)
class CheckedBetween:
    """Check between two windows: the arm compared with its identification."""

    after_windows: int
    changes: list[SlowChangeFigures]
    one_of: list[SlowChangeFigures]
    relaxed: bool
    learned_again: bool
    why: str


@dataclass(frozen=True)
class RestFigures:
    """Motion in a rest, and what was learned from it."""

    after_windows: int
    motion_s: float
    """Driven motion of all rests that the estimate uses [s]."""
    verdict: str
    is_taken: bool
    stated_Nm: list[float]
    """Residual torque that the carried arm states after the rest [N·m]."""
    share: list[float]
    """Share of the change of torque since the start of the session that is carried [-]."""
    why: str = ""
    """Sentences for the operator: decision, certainty, and what helps."""


@dataclass(frozen=True)
class PreparationFigures:
    """Figures of the preparation. A machine that only records has none."""

    self_test: SelfTestPassed | None = field(default=None, metadata=OPTIONAL)
    arm_check: ArmCheckFigures | None = field(default=None, metadata=OPTIONAL)
    identification: SessionIdentification | None = field(default=None, metadata=OPTIONAL)
    person_kept: bool | None = field(default=None, metadata=OPTIONAL)
    verified: list[VerifiedBetween] | None = field(default=None, metadata=OPTIONAL)
    checked: list[CheckedBetween] | None = field(default=None, metadata=OPTIONAL)
    learned: list[RestFigures] | None = field(default=None, metadata=OPTIONAL)


PREPARATION: TypeAdapter[PreparationFigures] = TypeAdapter(PreparationFigures)
"""Reads the figures from a checkpoint."""


PutRoom = Callable[[bool], object]
"""Function that brings screen and support to the participant, or takes them away."""


@dataclass(frozen=True)
class WornMachine:
    """Machine with its wearer in it, and the controller's knowledge of both."""

    pilot: Pilot
    controller: ArmController
    known: ControllerKnowledge
    put_room: PutRoom
    muscles: MuscleSource | None = None
    """EMG of the wearer; None if it is not measured."""


@dataclass
class Ready:
    """Machine with its participant, prepared for the windows."""

    pilot: Pilot
    controller: Controller
    put_room: PutRoom
    person: KnownPerson | None = None
    figures: PreparationFigures = field(default_factory=PreparationFigures)
    model: ArmModel | None = None
    watch: SessionWatch | None = None
    """Watch over the arm since its identification; None until it has seen the motion once."""
    learner: RestLearner | None = None
    """Estimate that runs through the rests; None before the first motion in a rest."""
    returning: WarmStart | None = None
    """Participant's file that the session starts from without identification; the first rest checks it."""
    muscles: MuscleSource | None = None
    """EMG of the wearer, which the rests use; None if it is not measured."""


def known_arm(worn: WornMachine, person: ParticipantRun, passed: SelfTestPassed) -> Ready:
    """Check the arm against the form for twenty seconds, identify it, then lay it on its support.

    Args:
        worn: Machine that carries the arm of the table, or of the participant's file.
        person: Participant's file, which the identification starts from and writes.
        passed: Figures of the machine's self-test.

    Raises:
        ConfigError: The arm does not agree with the form, or with the participant's file.
        RigError: The envelope stopped the run.
    """
    pilot, controller, machine = worn.pilot, worn.controller, worn.known.machine
    worn.put_room(False)
    model, body_mass_kg = ArmModel(worn.known.assembly, machine), person.told.mass_kg
    judge = ArmJudge(model)
    pilot.begin(ARM_CHECK)
    gentle = first_motion(pilot, controller, model)
    check = judge.judge([gentle], body_mass_kg)
    if check.is_sure:
        _refuse_other_arm(check)
    identifier = Identifier(
        pilot,
        controller,
        machine,
        "recursive",
        "current",
        lambda _t, estimate, predicted, _outcome: person.note(estimate, predicted),
        person.belief(machine),
    )
    kept = SampleCollector()
    person.listen(identifier)
    person.warn(pilot.recording, pilot.rig.t)
    identifier.followers.append(kept)
    found = identify_arm(pilot, controller, identifier, person.motion_s)
    if not check.is_sure:
        both = judge.judge([gentle, kept.samples], body_mass_kg)
        check = in_doubt_not_refused(both, found.restless_s is not None)
        _refuse_other_arm(check)
    written = person.keep(found, machine, "designed", "")
    lay_down(pilot, controller, worn.put_room)
    predicted = found.predicted[-1]
    figures = PreparationFigures(
        passed,
        ArmCheckFigures(round(check.arm_mass, 3), check.why, round(check.probability, 4)),
        SessionIdentification(
            motion_s=round(found.last.t, 3),
            outcome=found.outcome.value,
            from_file=person.returning is not None,
            predicted_left_over_Nm=None if predicted is None else rounded(predicted),
            why=f"{person.warning} {found.why}".strip(),
            carried=CarriedFigures.of(found.decided),
        ),
        isinstance(written, KeptParticipant),
    )
    floated = found.floated
    watch = None
    if floated.covariance is not None:
        watch = SessionWatch(identifier.model, floated.x, floated.covariance, kept.samples)
    return Ready(pilot, controller, worn.put_room, _kept(machine, floated), figures, identifier.model, watch)


def unknown_arm(worn: WornMachine, person: ParticipantRun, passed: SelfTestPassed) -> Ready:
    """Check the arm against the form for twenty seconds, then lay it on its support. The rests will show more of it.

    The machine carries the arm of the participant's file as far as the decision to float allows, else the table's.

    Args:
        worn: Machine that carries the arm of the table.
        person: Participant's file; without one the session starts from the table.
        passed: Figures of the machine's self-test.

    Raises:
        ConfigError: The arm does not agree with the form.
        RigError: The envelope stopped the run.
    """
    pilot, controller, known = worn.pilot, worn.controller, worn.known
    assembly, machine = known.assembly, known.machine
    worn.put_room(False)
    model = ArmModel(assembly, machine)
    pilot.begin(ARM_CHECK)
    check = ArmJudge(model).judge([first_motion(pilot, controller, model)], person.told.mass_kg)
    if check.is_sure:
        _refuse_other_arm(check)
    belief, x, covariance = person.belief(machine), known.x, prior(assembly, machine)[1]
    person.warn(pilot.recording, pilot.rig.t)
    if belief is not None:
        carried = arm_to_carry(Estimate(0.0, *belief, rejected_share=0.0, noise_scale=1.0), assembly, machine)
        if controller.publish(carried.x, pilot.q):
            x, covariance = carried.x, belief[1]
    pilot.worn = pilot.worn or PersonLimitsManager(pilot.envelope, assembly, machine, x)
    pilot.worn.know(x)
    lay_down(pilot, controller, worn.put_room)
    figures = PreparationFigures(
        passed, ArmCheckFigures(round(check.arm_mass, 3), check.why, round(check.probability, 4))
    )
    learner = RestLearner(model, x, belief, signals_of(worn.muscles))
    return Ready(
        pilot, controller, worn.put_room, KnownPerson.of(machine, x, covariance), figures, model, learner=learner,
        returning=person.returning, muscles=worn.muscles,
    )  # fmt: skip


def known_again(worn: WornMachine, before: KnownPerson, rests: KeptRests | None, person: ParticipantRun) -> Ready:
    """Prepare the same arm after an interruption, from its stored parameters.

    Args:
        worn: Machine that carries the arm of the checkpoint.
        before: Arm and machine of the checkpoint.
        rests: State of learning in rests; None without it.
        person: Participant's file. The first rest checks it, if the interruption came before.

    Raises:
        RigError: The envelope stopped the run.
    """
    pilot, controller, known = worn.pilot, worn.controller, worn.known
    worn.put_room(False)
    expected = prior(known.assembly, known.machine)[0]
    pilot.worn = pilot.worn or PersonLimitsManager(pilot.envelope, known.assembly, known.machine, expected)
    pilot.worn.know(known.x)
    controller.mode.drive = LAYING_DOWN.drive.goal(is_known=True)
    lay_down(pilot, controller, worn.put_room)
    model = ArmModel(known.assembly, known.machine)
    ready = Ready(pilot, controller, worn.put_room, before, model=model, muscles=worn.muscles)
    if rests is not None:
        ready.learner = RestLearner.continued(model, before, rests, signals_of(worn.muscles))
        if not rests.rests and person.belief(known.machine) is not None:
            ready.returning = person.returning
    return ready


def signals_of(source: MuscleSource | None) -> MuscleSignals | None:
    """Return the signals that the estimator gets from a source; None without one."""
    return None if source is None else MuscleSignals(source.channels)


def remembered(person: KnownPerson, assembly: Assembly, t: float) -> ControllerKnowledge:
    """Return the controller's knowledge of a checkpoint, for a machine that goes on at rig time `t` [s]."""
    fitted = replace(assembly, slid_m=person.slid_m)
    return ControllerKnowledge(fitted, read_machine(person.machine), np.array(person.x), t)


def lay_down(pilot: Pilot, controller: ArmController, put_room: PutRoom) -> None:
    """Move the relaxed arm to its donning posture, bring screen and support, and return its weight to the wearer."""
    posture, dt = controller.assembly.description.donning_posture, pilot.rig.period_s
    pilot.begin(LAYING_DOWN)
    way = LAYING_DOWN.approach(pilot.q, posture, dt)
    pilot.run(controller, way, "Bringing the arm to its support")
    put_room(True)
    fade(pilot, controller, "drive", Drive.NEVER.goal(is_known=True), posture)
    fade(pilot, controller, "gravity_level", 1.0, posture)


def _kept(machine: CalibratedMachine, found: Estimate) -> KnownPerson:
    """Arm and machine for the checkpoint, from which an interrupted run continues."""
    covariance = np.zeros((0, 0)) if found.covariance is None else found.covariance
    return KnownPerson.of(machine, found.x, covariance)


def person_run(file: Path | None, code: str, assembly: Assembly, serial: str, told: Body) -> ParticipantRun:
    """Read the participant's file, if there is one.

    Args:
        file: File of the participant's arm; None for none.
        code: Code of the participant.
        assembly: Machine with the arm of the table.
        serial: Serial number of the machine.
        told: Body data of the participant.

    Raises:
        ConfigError: The file is damaged, belongs to another machine or person, or is of another kind.
    """
    files = NO_FILES if file is None else ParticipantOptions.of_file(file, code)
    now = datetime.now(UTC).replace(microsecond=0)
    return ParticipantRun(files, assembly, serial, told, now, keep_option="--person-file")


def _refuse_other_arm(check: ArmCheck) -> None:
    if check.refused:
        raise ConfigError(f"{check.why} The training did not start.")
