"""Verification on the twin for `exograv arm verify`: calibration, identification, then the residual torque."""

import time
from dataclasses import replace
from datetime import UTC, datetime, timedelta

from exograv.loop.pilot import Progress
from exograv.next_command import calibration_command
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.identification.identify import identification_motion
from exograv.procedures.verification.change import read_former
from exograv.procedures.verification.figures import (
    VerifiedIdentification,
    VerifyResult,
    compared,
    verified_figures,
)
from exograv.procedures.verification.options import VerifyOptions
from exograv.procedures.verification.verification import verify_arm
from exograv.recording.rounding import rounded
from exograv.storage.self_test_pass import NOT_NEEDED

from .preparation import Preparation
from .virtual_laboratory import driven_laboratory

LATER_SEED = 500_000
"""Offset of the run's seed for a later verification, so that muscles and noise differ."""


def run_verification(options: VerifyOptions, progress: Progress) -> VerifyResult:
    """Run the verification.

    Raises:
        ConfigError: An option or a file is not valid.
        ModelError: Machine or wearer cannot be modelled, or the workspace has no room for the postures.
        IdentificationError: The empty machine is not as expected.
        RigError: The envelope stopped the run.
    """
    start = time.perf_counter()
    laboratory = driven_laboratory(options.rig, options.side, options.level, options.seed, options.world)
    former = None if options.before is None else read_former(options.before, laboratory.description.name)
    preparation = Preparation(laboratory, options.seed, progress)
    worn = preparation.worn(preparation.calibrated(options.calibration, make=calibration_command(options)))
    identifier = worn.identifier()
    found = worn.identify(identifier)
    pilot, controller = worn.pilot, worn.controller
    if options.later_min:
        # The same machine and person later, with the arm at the donning posture. No model is compiled again.
        later = replace(preparation, seed=LATER_SEED + options.seed)
        twin = laboratory.twin(later.seed, pilot.rig.t + 60.0 * options.later_min)
        pilot, controller = later.pilot_of(twin, pilot.actuators), controller.again(found.floated.x)
    seen = identification_motion(controller.assembly, MOTION_S, 50 * pilot.rig.period_s).q
    verified = verify_arm(pilot, controller, identifier.model, found.floated, seen, options.seed)
    truth = worn.examination(verified.postures).score(found.floated.x).total
    # On the twin the machine's clock replaces the wall clock.
    at = datetime.now(UTC) + timedelta(minutes=options.later_min)
    result = VerifyResult(
        rig=laboratory.description.name,
        disturbance_level=options.level,
        world=options.world,
        seed=options.seed,
        at_utc=at.isoformat(timespec="seconds"),
        found=verified_figures(verified, laboratory.description.joints),
        identification=VerifiedIdentification(round(found.last.t, 3), found.outcome.value),
        self_test=NOT_NEEDED,
        truth_Nm=rounded(truth),
        simulated_s=round(pilot.rig.t, 3),
    )
    return replace(compared(result, former), wall_s=round(time.perf_counter() - start, 2))
