"""The whole idea on the twin: calibrate, put the arm in, identify it online, float it, find a known weight, report."""

import time
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np

from exograv.dynamics import parameters
from exograv.dynamics.actuator import ActuatorGain
from exograv.dynamics.machine import CalibratedMachine
from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate, Outcome, RestingMethod
from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import limits, refuse_motorless
from exograv.loop.pilot import Pilot, Progress
from exograv.model.arm import held_weight
from exograv.procedures.identification.estimator_session import Identification, table_guess
from exograv.procedures.identification.float_arm import Drift, float_arm
from exograv.procedures.identification.identify import Identifier, identify_arm
from exograv.procedures.identification.motions import motion_parts
from exograv.procedures.identification.participant_session import ParticipantRun
from exograv.procedures.weighing.known_weight import weigh
from exograv.procedures.weighing.weight_estimator import Weighing
from exograv.recording import RecordingWriter
from exograv.recording.rounding import percentiles, rounded
from exograv.rig.twin import Twin, WearerModel
from exograv.runtime.clock.pace import RealTimePace
from exograv.safety.envelope import Envelope
from exograv.storage.calibration_file import TakenCalibration, take_calibration, twin_identity
from exograv.study.targets import TARGET_NM

from .demo_options import DemoOptions as DemoOptions
from .provenance import provenance
from .result_rows import calibration_rows, identifiability_rows, parameter_rows, time_to_target
from .truth_score import Examination, Score
from .twin_calibration import EmptyTwin
from .virtual_laboratory import VirtualLaboratory, draw_laboratory

FLOAT_S = 10.0
WEIGHT_KG = (0.5, 1.0)  # range of the known weight that the wearer takes into the hand; the machine is built for 1 kg


@dataclass
class _Run:
    """What the phases of one demonstration share."""

    options: DemoOptions
    laboratory: VirtualLaboratory
    recording: RecordingWriter
    progress: Progress
    taken: TakenCalibration | None
    person: ParticipantRun
    result: dict[str, Any] = field(default_factory=dict)
    of_person: dict[str, Any] = field(default_factory=dict)
    """Of the participant's file: shown, and no part of the recording."""

    def pilot(self, twin: Twin, actuators: ActuatorGain) -> Pilot:
        envelope = Envelope(limits(self.laboratory.description), twin.period_s)
        pace = RealTimePace(twin.period_s) if self.options.realtime else None
        return Pilot(twin, actuators, envelope, self.recording, self.progress, pace)


def run_demo(options: DemoOptions, folder: Path, progress: Progress) -> dict[str, Any]:
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
        options.files,
        laboratory.assembly(),
        twin_identity(options.level, options.seed),
        laboratory.body,
        datetime.now(UTC).replace(microsecond=0),
    )
    settings = provenance(options, laboratory, targets)
    settings["hashes"] |= person.hashes
    if taken is not None:
        settings["hashes"]["calibration"] = taken.whole.content_sha256
    with RecordingWriter(path, laboratory.description.joints, settings) as recording:
        run = _Run(options, laboratory, recording, progress, taken, person)
        t, tick_us = _phases(run, targets)
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
        **_told_by(laboratory.wearer_model),
        "tick_us": percentiles(tick_us),
        "wall_s": round(time.perf_counter() - start, 2),
        "simulated_s": round(t, 3),
        "report": str(report),
        "recording": str(path),
    }


def _told_by(model: WearerModel | None) -> dict[str, Any]:
    """Whose arm was the truth, and what of its model is not used."""
    return {} if model is None else {"wearer_model": {"title": model.title, "notes": list(model.notes)}}


def _phases(run: _Run, targets: list[float]) -> tuple[float, list[float]]:
    options, laboratory = run.options, run.laboratory
    description = laboratory.description
    run.result.update(
        rig=description.name,
        method=options.method,
        motion=options.motion,
        disturbance_level=options.level,
        seed=options.seed,
        joints=list(description.joints),
    )
    machine, t = _stage_0(run)

    assembly = run.person.assembly
    table = table_guess(assembly, machine)
    twin = Twin(description, laboratory.machine, laboratory.wearer, options.day, t0=t)
    pilot = run.pilot(twin, machine.actuators)
    controller = ArmController(assembly, machine, table, twin.period_s)
    examination = Examination(laboratory, assembly, machine)
    scores: dict[float, Score] = {}

    def note(when: float, estimate: Estimate, predicted: np.ndarray | None, outcome: Outcome) -> None:
        rows = parameter_rows(assembly, identifier.result.prior, estimate, laboratory.wearer)
        shown = [{k: v for k, v in row.items() if k != "truth"} for row in rows]
        message = {"motion_s": estimate.t, "parameters": shown, "outcome": outcome.value}
        if predicted is not None:
            message["predicted_left_over_Nm"] = predicted
        run.recording.write("/estimate", when, message)
        run.person.note(estimate, predicted)
        scores[estimate.t] = score = examination.score(estimate.x)
        run.recording.write("/left_over", when, {"motion_s": estimate.t, "total": score.total, "arm": score.arm})

    identifier = Identifier(
        pilot, controller, machine, options.method, options.torque_source, note, run.person.belief(machine)
    )
    run.person.listen(identifier)
    parts = motion_parts(
        options.motion, assembly, machine, identifier.result.method, options.seconds, twin.period_s
    )  # fmt: skip
    found = identify_arm(pilot, controller, identifier, options.seconds, parts)
    _record_identification(run, found, examination, table, scores, targets, assembly)
    _record_person(run, found, machine, examination, targets)
    if not options.only_identify:
        _float_and_weigh(run, pilot, controller, identifier.model, found, examination)
    return twin.t, pilot.tick_us


def _stored_calibration(options: DemoOptions, laboratory: VirtualLaboratory) -> TakenCalibration | None:
    if options.calibration is None:
        return None
    machine = twin_identity(options.level, options.seed)
    return take_calibration(options.calibration, laboratory.description, machine, datetime.now(UTC))


def _stage_0(run: _Run) -> tuple[CalibratedMachine, float]:
    """The calibrated machine and its clock: stored, and cold again, or calibrated now."""
    laboratory, taken = run.laboratory, run.taken
    if taken is None:
        seed, lengths = run.options.day, laboratory.wearer.lengths_given
        empty = EmptyTwin(laboratory.description, laboratory.machine, seed, lengths)
        calibration, t = empty.calibrate(run.pilot)
        run.result["calibration_used"] = {"source": "measured at the start of this run"}
    else:
        calibration, t = taken.whole.calibration(), 0.0
        run.result["calibration_used"] = taken.used
        if taken.warning is not None:
            run.recording.write("/event", t, {"kind": "warning", "text": taken.warning})
    joints = laboratory.description.joints
    run.result["calibration"] = calibration_rows(calibration.machine, laboratory.machine, t, joints)
    return calibration.machine, t


def _record_identification(
    run: _Run,
    found: Identification,
    examination: Examination,
    table: np.ndarray,
    scores: dict[float, Score],
    targets: list[float],
    assembly: Any,
) -> None:
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
    doubted = examination.posterior_torque(found.last)
    run.result["identification"] = {
        **({"rest_s": round(found.method.rest_s, 3)} if isinstance(found.method, RestingMethod) else {}),
        "motion_s": round(found.last.t, 3),
        "time_to_target_s": time_to_target(scores, targets),
        "stop": stop,
        "outcome": found.outcome.value,
        "why": found.why,
        "restless_s": found.restless_s and round(found.restless_s, 2),
    }
    run.result["identifiability"] = identifiability_rows(assembly, found.prior_covariance, found.last)
    run.result["possible_left_over_Nm"] = doubted and {
        "median": rounded(doubted.median),
        "p95": rounded(doubted.p95),
    }
    run.result["parameters"] = parameter_rows(assembly, found.prior, found.last, run.laboratory.wearer)


def _record_person(
    run: _Run,
    found: Identification,
    machine: CalibratedMachine,
    examination: Examination,
    targets: list[float],
) -> None:
    """What the participant's file did and what it holds now; the examiner's view is shown and never kept in it."""
    calibration = "" if run.taken is None else run.taken.whole.content_sha256
    kept = run.person.keep(found, machine, run.options.motion, calibration)
    if kept is not None:
        run.of_person["participant_kept"] = kept
    returning = run.person.returning
    if returning is not None:
        cold = {estimate.t: examination.score(estimate.x) for estimate in returning.cold_estimates}
        run.of_person["participant"] = returning.figures | {
            "examiner": {
                "from_file_s": run.result["identification"]["time_to_target_s"],
                "cold_s": time_to_target(cold, targets),
            }
        }


def _float_and_weigh(
    run: _Run,
    pilot: Pilot,
    controller: ArmController,
    model: ArmModel,
    found: Identification,
    examination: Examination,
) -> None:
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
        if isinstance(pilot.rig, Twin):
            pilot.rig.hang("hand", mass if loaded else 0.0)

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
