"""Demonstration on the twin: calibrate, identify the arm online, float it, estimate a known weight, write a report."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from exograv.dynamics import parameters
from exograv.identification.calibration.empty_machine import Calibration
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Outcome, RestingMethod
from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.moved_machine import PilotedArm
from exograv.loop.phases import WEIGHING
from exograv.loop.pilot import Progress
from exograv.model.arm import held_weight
from exograv.next_command import calibration_command
from exograv.procedures.identification.carried_figures import CarriedFigures
from exograv.procedures.identification.controller_knowledge import ControllerKnowledge
from exograv.procedures.identification.estimator_session import Identification
from exograv.procedures.identification.float_arm import Drift, float_arm
from exograv.procedures.identification.identify import identify_arm
from exograv.procedures.identification.motions import motion_parts
from exograv.procedures.identification.options import NO_FILES, ParticipantOptions
from exograv.procedures.identification.participant_session import ParticipantRun
from exograv.procedures.weighing.known_weight import weigh
from exograv.procedures.weighing.weight_estimator import Weighing
from exograv.recording import RecordingWriter
from exograv.recording.rounding import percentiles, rounded
from exograv.results import json_value
from exograv.rig.twin import Disturbances, day_seed
from exograv.storage.calibration_file import TakenCalibration, take_calibration
from exograv.study.targets import TARGET_NM

from .demo_result import (
    ControllerLeftOver,
    DemoFindings,
    DemoResult,
    ExaminedTimes,
    FloatedArm,
    FloatFigures,
    HandWeight,
    IdentificationFigures,
    IdentifiedArm,
    LeftOverTable,
    MeasuredCalibration,
    ModelNotes,
    ParticipantFigures,
    PayloadLeftOver,
    PossibleLeftOver,
    ReturningParticipant,
)
from .kept_calibration import AUTO, keep, kept_file, take_kept
from .options import DemoOptions as DemoOptions
from .preparation import Preparation, WornTwin
from .provenance import provenance
from .reference_wearers import compare
from .result_rows import (
    CalibrationRow,
    WeightRow,
    calibration_rows,
    identifiability_rows,
    parameter_rows,
    time_to_target,
)
from .truth_score import Examination, TruthScore
from .virtual_laboratory import VirtualLaboratory, draw_laboratory, with_twin

FLOAT_S = 10.0
WEIGHT_KG = (0.5, 1.0)  # Range of the known weight in the wearer's hand. The machine is built for 1 kg.


@dataclass(frozen=True)
class _Run:
    """Values that the phases of one demonstration share."""

    options: DemoOptions
    preparation: Preparation
    recording: RecordingWriter
    taken: TakenCalibration | None
    calibrated: tuple[Calibration, float]
    """Calibration of the machine, and the rig's clock after it [s]."""
    person: ParticipantRun
    targets: list[float]
    """Residual torque that counts as reached, by joint [N·m]."""

    @property
    def laboratory(self) -> VirtualLaboratory:
        """Virtual laboratory of the demonstration: machine and wearer, drawn from the seed."""
        return self.preparation.laboratory


@dataclass(frozen=True)
class _Phases:
    """Findings of all phases, and the rig's clock at the end [s]."""

    findings: DemoFindings
    person: ParticipantFigures
    t: float
    tick_us: Mapping[float, int]


def run_demo(
    options: DemoOptions, folder: Path, progress: Progress, files: ParticipantOptions = NO_FILES
) -> DemoResult:
    """Run the demonstration.

    Raises:
        ConfigError: An option is not valid.
        ModelError: Machine or wearer cannot be modelled.
        RigError: The envelope stopped the run.
        RecordingError: The folder cannot be written.
    """
    start = time.perf_counter()
    files.refuse_method(options.method)
    laboratory = draw_laboratory(
        options.rig,
        options.side,
        options.level,
        options.seed,
        options.wearer_model,
        options.wearer_map,
        options.donning,
        options.world,
    )
    disturbances = Disturbances.at_level(options.level, options.world)
    laboratory = with_twin(laboratory, options.twin, disturbances, options.seed)
    refuse_motorless(laboratory.description)
    targets = [TARGET_NM[place] for place in laboratory.description.places]
    path = folder / f"{'identify' if options.only_identify else 'demo'}.mcap"
    taken, kept = _stored_calibration(options, laboratory)
    person = ParticipantRun(
        files,
        laboratory.assembly(),
        laboratory.serial,
        laboratory.body,
        datetime.now(UTC).replace(microsecond=0),
    )
    hashes = person.hashes | ({} if taken is None else {"calibration": taken.whole.content_sha256})
    settings = provenance(options, laboratory, targets, hashes)
    joints, seed = laboratory.description.joints, day_seed(options.seed, options.donning)
    preparation = Preparation(laboratory, seed, progress, None, options.realtime)
    if taken is None:
        # The calibration has its own file: it has five times as many ticks as the rest, and few readers need them.
        empty = path.with_stem(f"{path.stem}_calibration")
        with RecordingWriter(empty, joints, json_value(settings), packed=True) as recording:
            known = replace(preparation, recording=recording).calibrate()
        if kept is not None:
            keep(kept, laboratory, *known)
    else:
        known = taken.whole.calibration(), 0.0
    with RecordingWriter(path, joints, json_value(settings), packed=True) as recording:
        preparation = replace(preparation, recording=recording)
        run = _Run(options, preparation, recording, taken, known, person, targets)
        done = _phases(run)
        simulated_s = round(done.t, 3)
        recording.write("/result", done.t, {**json_value(done.findings), "simulated_s": simulated_s})
    progress("Writing the report", 0.0)
    from exograv.report.of_recording.recording_report import (
        write_report,  # The import of Matplotlib takes 0.4 s; no tick waits for it.
    )

    report = write_report(path, folder / "report.html")
    progress("Writing the report", 1.0)
    model = laboratory.wearer_model
    return DemoResult(
        findings=done.findings,
        person=done.person,
        donning=options.donning,
        wearer_model=None if model is None else ModelNotes(model.title, model.notes),
        tick_us=percentiles(done.tick_us),
        wall_s=round(time.perf_counter() - start, 2),
        simulated_s=simulated_s,
        report=report,
        recording=path,
    )


def _phases(run: _Run) -> _Phases:
    options, laboratory, person = run.options, run.laboratory, run.person
    description = laboratory.description
    known, calibration = _known_machine(run)
    worn = run.preparation.worn(known)
    examination = worn.examination()
    scores: dict[float, TruthScore] = {}

    def note(when: float, estimate: Estimate, predicted: np.ndarray | None, outcome: Outcome) -> None:
        rows = parameter_rows(known.assembly, identifier.result.prior, estimate, laboratory.wearer)
        shown = [{k: v for k, v in vars(row).items() if k != "truth"} for row in rows]
        message = {"motion_s": estimate.t, "parameters": shown, "outcome": outcome.value}
        if predicted is not None:
            message["predicted_left_over_Nm"] = predicted
        run.recording.write("/estimate", when, message)
        person.note(estimate, predicted)
        scores[estimate.t] = score = examination.score(estimate.x)
        run.recording.write("/left_over", when, {"motion_s": estimate.t, "total": score.total, "arm": score.arm})

    identifier = worn.identifier(options.method, options.torque_source, note, person.belief(known.machine))
    person.listen(identifier)
    person.warn(run.recording, worn.twin.t)
    method = identifier.result.method
    parts = motion_parts(options.motion, known.assembly, known.machine, method, options.seconds, worn.twin.period_s)
    found = identify_arm(worn.pilot, worn.controller, identifier, options.seconds, parts)
    arm = _identified_arm(run, found, known, examination, scores)
    of_person = _participant_figures(run, found, known, examination, arm.identification.time_to_target_s)
    is_short = options.only_identify
    findings = DemoFindings(
        rig=description.name,
        method=options.method,
        motion=options.motion,
        disturbance_level=options.level,
        world=options.world,
        seed=options.seed,
        joints=description.joints,
        calibration_used=MeasuredCalibration() if run.taken is None else run.taken.used,
        calibration=calibration,
        comparison=compare(
            options,
            run.taken is None and person.returning is None,
            description.joints,
            arm.left_over_rms_Nm.total.identified,
        ),
        arm=arm,
        floated=None if is_short else _float_and_weigh(run, worn, identifier.model, found, examination),
    )
    return _Phases(findings, of_person, worn.twin.t, worn.pilot.tick_us)


def _stored_calibration(
    options: DemoOptions, laboratory: VirtualLaboratory
) -> tuple[TakenCalibration | None, Path | None]:
    """Return the stored calibration, if any, and the file in which a new one is to be kept."""
    if options.calibration is None:
        return None, None
    if options.calibration == AUTO:
        file = kept_file(laboratory, day_seed(options.seed, options.donning))
        return None if file is None else take_kept(file, laboratory), file
    make, now = calibration_command(options), datetime.now(UTC)
    return take_calibration(options.calibration, laboratory.description, laboratory.serial, now, make), None


def _known_machine(run: _Run) -> tuple[ControllerKnowledge, list[CalibrationRow]]:
    """Return the machine by its stored calibration, then cold again, or as calibrated now."""
    laboratory, taken, (calibration, t) = run.laboratory, run.taken, run.calibrated
    if taken is not None and taken.warning is not None:
        run.recording.write("/event", t, {"kind": "warning", "text": taken.warning})
    rows = calibration_rows(calibration.machine, laboratory.machine, t, laboratory.description.joints)
    return run.preparation.known(calibration, t, run.person.assembly), rows


def _identified_arm(
    run: _Run,
    found: Identification,
    known: ControllerKnowledge,
    examination: Examination,
    scores: dict[float, TruthScore],
) -> IdentifiedArm:
    by_table, identified = examination.score(known.x), scores[found.last.t]
    total = ControllerLeftOver(
        rounded(examination.exo_only(known.x)), rounded(by_table.total), rounded(identified.total)
    )
    stop = "The motion ran its full time."
    if found.stop_s is not None:
        stop = f"The stop rule would have ended the motion after {found.stop_s:.0f} s."
    possible = examination.posterior_torque(found.last)
    return IdentifiedArm(
        LeftOverTable(total, ControllerLeftOver(None, rounded(by_table.arm), rounded(identified.arm))),
        IdentificationFigures(
            rest_s=round(found.method.rest_s, 3) if isinstance(found.method, RestingMethod) else None,
            motion_s=round(found.last.t, 3),
            time_to_target_s=time_to_target(scores, run.targets),
            stop=stop,
            outcome=found.outcome,
            why=found.why,
            restless_s=found.restless_s and round(found.restless_s, 2),
            carried=CarriedFigures.of(found.decided),
        ),
        identifiability_rows(known.assembly, found.prior_covariance, found.last),
        possible and PossibleLeftOver(rounded(possible.median), rounded(possible.p95)),
        parameter_rows(known.assembly, found.prior, found.last, run.laboratory.wearer),
    )


def _participant_figures(
    run: _Run, found: Identification, known: ControllerKnowledge, examination: Examination, reached_s: float | None
) -> ParticipantFigures:
    """Write the participant's file and note the effect of the former one. The file holds nothing of the examiner's."""
    calibration = "" if run.taken is None else run.taken.whole.content_sha256
    kept = run.person.keep(found, known.machine, run.options.motion, calibration)
    returning = run.person.returning
    if returning is None:
        return ParticipantFigures(kept, None, run.person.warning or None)
    cold = {estimate.t: examination.score(estimate.x) for estimate in returning.cold_estimates}
    times = ExaminedTimes(reached_s, time_to_target(cold, run.targets))
    return ParticipantFigures(kept, ReturningParticipant(returning.figures, times))


def _float_and_weigh(
    run: _Run, worn: WornTwin, model: ArmModel, found: Identification, examination: Examination
) -> FloatedArm:
    pilot, controller, arm = worn.pilot, worn.controller, found.floated
    options, description = run.options, run.laboratory.description
    lower, upper = description.workspace
    posture = 0.5 * (lower + upper)
    drift: Drift = float_arm(
        pilot, controller, posture, options.gravity_level, FLOAT_S, covariance=arm.covariance, model=model
    )
    mass = float(np.random.default_rng([options.seed, 9]).uniform(*WEIGHT_KG))
    pilot.begin(WEIGHING)

    def hang(loaded: bool) -> None:
        worn.twin.hang("hand", mass if loaded else 0.0)

    weighing: Weighing = weigh(PilotedArm(pilot, controller), model, arm, hang)
    with_weight = arm.x.copy()
    assembly = controller.assembly
    with_weight[parameters.ParameterLayout.of(assembly).phi] += held_weight(assembly.arm, weighing.mass)
    ignored, compensated = (rounded(examination.score(x, mass).total) for x in (arm.x, with_weight))
    float_arm(
        pilot,
        controller,
        posture,
        options.gravity_level,
        FLOAT_S / 2,
        "float with weight",
        arm.covariance,
        model,
    )
    return FloatedArm(
        FloatFigures(options.gravity_level, rounded(drift.drift_deg), drift.window_s),
        HandWeight(WeightRow.of(round(mass, 4), weighing), PayloadLeftOver(ignored, compensated)),
    )
