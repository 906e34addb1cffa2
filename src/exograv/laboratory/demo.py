"""Demonstration on the twin: calibrate, identify the arm online, float it, estimate a known weight, write a report."""

import time
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from exograv.dynamics import parameters
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Outcome, RestingMethod
from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.pilot import Progress
from exograv.model.arm import held_weight
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
from exograv.rig.twin import WearerModel, day_seed
from exograv.storage.calibration_file import TakenCalibration, take_calibration
from exograv.study.targets import TARGET_NM

from .options import DemoOptions as DemoOptions
from .preparation import Preparation, WornTwin
from .provenance import provenance
from .result_rows import calibration_rows, identifiability_rows, parameter_rows, time_to_target
from .truth_score import Examination, Score
from .virtual_laboratory import VirtualLaboratory, draw_laboratory

FLOAT_S = 10.0
WEIGHT_KG = (0.5, 1.0)  # range of the known weight that the wearer takes into the hand; the machine is built for 1 kg


@dataclass
class _Run:
    """Values that the phases of one demonstration share."""

    options: DemoOptions
    preparation: Preparation
    recording: RecordingWriter
    taken: TakenCalibration | None
    person: ParticipantRun
    targets: list[float]
    """Residual torque that counts as reached, by joint [N·m]."""
    result: dict[str, Any] = field(default_factory=dict)
    of_person: dict[str, Any] = field(default_factory=dict)
    """Figures of the participant's file: shown, and not written to the recording."""

    @property
    def laboratory(self) -> VirtualLaboratory:
        """Machine and wearer."""
        return self.preparation.laboratory


def run_demo(
    options: DemoOptions, folder: Path, progress: Progress, files: ParticipantOptions = NO_FILES
) -> dict[str, Any]:
    """Run it all; the result follows the contract of `exograv demo --json`.

    Raises:
        ConfigError: An option cannot be used.
        ModelError: Machine or wearer cannot be modelled.
        RigError: The envelope stopped the run.
        RecordingError: The folder cannot be written.
    """
    start = time.perf_counter()
    laboratory = draw_laboratory(
        options.rig,
        options.side,
        options.level,
        options.seed,
        options.wearer_model,
        options.wearer_map,
        options.donning,
    )
    refuse_motorless(laboratory.description)
    targets = [TARGET_NM[place] for place in laboratory.description.places]
    path = folder / f"{'identify' if options.only_identify else 'demo'}.mcap"
    taken = _stored_calibration(options, laboratory)
    person = ParticipantRun(
        files,
        laboratory.assembly(),
        laboratory.serial,
        laboratory.body,
        datetime.now(UTC).replace(microsecond=0),
    )
    settings = provenance(options, laboratory, targets)
    settings["hashes"] |= person.hashes
    if taken is not None:
        settings["hashes"]["calibration"] = taken.whole.content_sha256
    with RecordingWriter(path, laboratory.description.joints, settings) as recording:
        preparation = Preparation(
            laboratory, day_seed(options.seed, options.donning), progress, recording, options.realtime
        )
        run = _Run(options, preparation, recording, taken, person, targets)
        t, tick_us = _phases(run)
        recording.write("/result", t, {**run.result, "simulated_s": round(t, 3)})
    progress("Writing the report", 0.0)
    from exograv.report.of_recording.recording_report import (
        write_report,  # Matplotlib: 0.4 s that no tick has to wait for
    )

    report = write_report(path, folder / "report.html")
    progress("Writing the report", 1.0)
    return {
        **run.result,
        **run.of_person,
        "donning": options.donning,
        **_model_figures(laboratory.wearer_model),
        "tick_us": percentiles(tick_us),
        "wall_s": round(time.perf_counter() - start, 2),
        "simulated_s": round(t, 3),
        "report": str(report),
        "recording": str(path),
    }


def _model_figures(model: WearerModel | None) -> dict[str, Any]:
    """Title of the third party's model that was the truth, and notes on what of it is not used."""
    return {} if model is None else {"wearer_model": {"title": model.title, "notes": list(model.notes)}}


def _phases(run: _Run) -> tuple[float, list[float]]:
    """Fill the results; return the rig's clock at the end [s] and the time of each tick [µs]."""
    options, laboratory, person = run.options, run.laboratory, run.person
    description = laboratory.description
    run.result.update(
        rig=description.name,
        method=options.method,
        motion=options.motion,
        disturbance_level=options.level,
        seed=options.seed,
        joints=list(description.joints),
    )
    known = _known_machine(run)
    worn = run.preparation.worn(known)
    examination = worn.examination()
    scores: dict[float, Score] = {}

    def note(when: float, estimate: Estimate, predicted: np.ndarray | None, outcome: Outcome) -> None:
        rows = parameter_rows(known.assembly, identifier.result.prior, estimate, laboratory.wearer)
        shown = [{k: v for k, v in row.items() if k != "truth"} for row in rows]
        message = {"motion_s": estimate.t, "parameters": shown, "outcome": outcome.value}
        if predicted is not None:
            message["predicted_left_over_Nm"] = predicted
        run.recording.write("/estimate", when, message)
        person.note(estimate, predicted)
        scores[estimate.t] = score = examination.score(estimate.x)
        run.recording.write("/left_over", when, {"motion_s": estimate.t, "total": score.total, "arm": score.arm})

    identifier = worn.identifier(options.method, options.torque_source, note, person.belief(known.machine))
    person.listen(identifier)
    method = identifier.result.method
    parts = motion_parts(options.motion, known.assembly, known.machine, method, options.seconds, worn.twin.period_s)
    found = identify_arm(worn.pilot, worn.controller, identifier, options.seconds, parts)
    _record_identification(run, found, known, examination, scores)
    _record_person(run, found, known, examination)
    if not options.only_identify:
        _float_and_weigh(run, worn, identifier.model, found, examination)
    return worn.twin.t, worn.pilot.tick_us


def _stored_calibration(options: DemoOptions, laboratory: VirtualLaboratory) -> TakenCalibration | None:
    if options.calibration is None:
        return None
    return take_calibration(options.calibration, laboratory.description, laboratory.serial, datetime.now(UTC))


def _known_machine(run: _Run) -> ControllerKnowledge:
    """The machine by its stored calibration, then cold again, or as calibrated now."""
    laboratory, taken = run.laboratory, run.taken
    if taken is None:
        calibration, t = run.preparation.calibrate()
        run.result["calibration_used"] = {"source": "measured at the start of this run"}
    else:
        calibration, t = taken.whole.calibration(), 0.0
        run.result["calibration_used"] = taken.used
        if taken.warning is not None:
            run.recording.write("/event", t, {"kind": "warning", "text": taken.warning})
    joints = laboratory.description.joints
    run.result["calibration"] = calibration_rows(calibration.machine, laboratory.machine, t, joints)
    return run.preparation.known(calibration, t, run.person.assembly)


def _record_identification(
    run: _Run,
    found: Identification,
    known: ControllerKnowledge,
    examination: Examination,
    scores: dict[float, Score],
) -> None:
    table, assembly = known.x, known.assembly
    by_table, identified = examination.score(table), scores[found.last.t]
    run.result["left_over_rms_Nm"] = {
        "total": {
            "exo_only": rounded(examination.exo_only(table)),
            "table": rounded(by_table.total),
            "identified": rounded(identified.total),
        },
        "arm": {"table": rounded(by_table.arm), "identified": rounded(identified.arm)},
    }
    stop = "The motion ran its full time."
    if found.stop_s is not None:
        stop = f"The stop rule would have ended the motion after {found.stop_s:.0f} s."
    possible = examination.posterior_torque(found.last)
    run.result["identification"] = {
        **({"rest_s": round(found.method.rest_s, 3)} if isinstance(found.method, RestingMethod) else {}),
        "motion_s": round(found.last.t, 3),
        "time_to_target_s": time_to_target(scores, run.targets),
        "stop": stop,
        "outcome": found.outcome.value,
        "why": found.why,
        "restless_s": found.restless_s and round(found.restless_s, 2),
    }
    run.result["identifiability"] = identifiability_rows(assembly, found.prior_covariance, found.last)
    run.result["possible_left_over_Nm"] = possible and {
        "median": rounded(possible.median),
        "p95": rounded(possible.p95),
    }
    run.result["parameters"] = parameter_rows(assembly, found.prior, found.last, run.laboratory.wearer)


def _record_person(run: _Run, found: Identification, known: ControllerKnowledge, examination: Examination) -> None:
    """Note the effect of the participant's file and its new content. The file holds nothing of the examiner's."""
    calibration = "" if run.taken is None else run.taken.whole.content_sha256
    kept = run.person.keep(found, known.machine, run.options.motion, calibration)
    if kept is not None:
        run.of_person["participant_kept"] = kept
    returning = run.person.returning
    if returning is not None:
        cold = {estimate.t: examination.score(estimate.x) for estimate in returning.cold_estimates}
        run.of_person["participant"] = returning.figures | {
            "examiner": {
                "from_file_s": run.result["identification"]["time_to_target_s"],
                "cold_s": time_to_target(cold, run.targets),
            }
        }


def _float_and_weigh(
    run: _Run, worn: WornTwin, model: ArmModel, found: Identification, examination: Examination
) -> None:
    pilot, controller = worn.pilot, worn.controller
    options, description = run.options, run.laboratory.description
    lower, upper = description.workspace
    posture = 0.5 * (lower + upper)
    drift: Drift = float_arm(pilot, controller, posture, options.gravity_level, FLOAT_S)
    run.result["float"] = {
        "gravity_level": options.gravity_level,
        "drift_deg": rounded(drift.drift_deg),
        "window_s": drift.window_s,
    }
    mass = float(np.random.default_rng([options.seed, 9]).uniform(*WEIGHT_KG))
    pilot.begin("weigh")

    def hang(loaded: bool) -> None:
        worn.twin.hang("hand", mass if loaded else 0.0)

    weighing: Weighing = weigh(pilot, controller, model, found.last, hang)
    with_weight = found.last.x.copy()
    assembly = controller.assembly
    with_weight[parameters.ParameterLayout.of(assembly).phi] += held_weight(assembly.arm, weighing.mass)
    run.result["known_weight"] = {
        "true_kg": round(mass, 4),
        "estimated_kg": round(weighing.mass, 4),
        "ci95_kg": rounded(np.array(weighing.ci95)),
        "left_over_Nm": {
            "ignored": rounded(examination.score(found.last.x, mass).total),
            "compensated": rounded(examination.score(with_weight, mass).total),
        },
    }
    float_arm(pilot, controller, posture, options.gravity_level, FLOAT_S / 2, "float with weight")
