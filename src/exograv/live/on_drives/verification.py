"""Verification on drives (`exograv arm verify --drives`): live identification, passes at unseen postures, verdict."""

from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path

from exograv.errors import RigError
from exograv.identification.core.arm_model import ArmModel
from exograv.live.options import LiveOptions, ReturningPerson
from exograv.loop.pilot import Progress
from exograv.model.description import load_rig
from exograv.next_command import same_machine
from exograv.options import WornOptions
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.identification.simulated_wearer import SimulatedWearer
from exograv.procedures.verification.change import read_former
from exograv.procedures.verification.figures import (
    VerifiedIdentification,
    VerifyResult,
    compared,
    verified_figures,
)
from exograv.procedures.verification.options import VerifyOptions
from exograv.procedures.verification.verification import VerificationResult, evaluate_passes

from .arm_files import stored_arm
from .connection import Say
from .float_command import FlownOnDrives, Procedure, fly_on_drives

FLOATS_S = 5.0
"""Time for which the arm floats after the passes [s]."""


def run_verification_on_drives(
    options: VerifyOptions,
    person: ReturningPerson,
    folder: Path,
    progress: Progress,
    say: Say,
    wearer: SimulatedWearer | None = None,
) -> VerifyResult:
    """Identify an arm on drives, or check a stored one, verify it, and compare with an earlier verification.

    Raises:
        ConfigError: An option or a file cannot be used.
        ModelError: The task workspace has no room for the postures.
        RigError: The machine is locked, a drive does not answer, or a stop came before the end of the last pass.
        RecordingError: There is no room for the recording.
    """
    former = None if options.before is None else read_former(options.before, load_rig(options.rig, options.side).name)
    worn = {one.name: getattr(options, one.name) for one in fields(WornOptions)}
    live = LiveOptions(**worn, seconds=FLOATS_S, identify_s=MOTION_S)
    procedure = Procedure("arm verify", files=stored_arm(person, options, folder), is_verified=True)
    run = fly_on_drives(live, person, folder, progress, say, wearer, procedure)
    at = datetime.now(UTC)
    verified = _judged(run, progress, same_machine("rig self-test", options, folder))
    description, learned = run.prepared.assembly.description, run.figures.identified
    assert learned is not None
    return compared(
        VerifyResult(
            rig=description.name,
            disturbance_level=options.level if options.simulate else None,
            world=options.world if options.simulate else None,
            seed=options.seed,
            at_utc=at.isoformat(timespec="seconds"),
            found=verified_figures(verified, description.joints),
            identification=VerifiedIdentification(learned.motion_s, learned.outcome),
            self_test=run.figures.self_test,
            truth_Nm=_truth(run, verified),
            live=run.figures,
        ),
        former,
    )


def _judged(run: FlownOnDrives, progress: Progress, test: str) -> VerificationResult:
    learned, passed, asked = run.flown.learned, run.flown.passed, run.verification
    if learned is None or passed is None or asked is None:
        latches = run.flown.report.latches
        why = f"it stopped after {latches[0].at_s:.1f} s: {latches[0].cause}" if latches else "the run ended early."
        raise RigError(
            f"The machine did not lead the arm past all postures; {why} Recording until then: {run.flown.path}. After "
            f"a stop test the machine again (`{test}`), then repeat."
        )
    model = ArmModel(run.prepared.assembly, run.prepared.machine)
    return evaluate_passes(model, learned.floated, asked.postures, passed.heard, passed.seconds, progress)


def _truth(run: FlownOnDrives, verified: VerificationResult) -> list[float] | None:
    """Return the true left over per joint [N·m]; None if machine and person are real."""
    if run.wearer is None or run.flown.learned is None:
        return None
    return run.wearer.left_over_Nm(run.prepared, run.flown.learned.carried.x, verified.postures)
