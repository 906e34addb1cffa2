"""`exograv verify` on the twin: the machine calibrated, the arm identified, and then what is left over where."""

import time
from datetime import UTC, datetime, timedelta
from typing import Any

from exograv.loop.arm_controller import ArmController
from exograv.loop.machine_limits import refuse_motorless
from exograv.loop.pilot import Pilot, Progress
from exograv.procedures.identification.controller_knowledge import MOTION_S
from exograv.procedures.identification.estimator_session import Identification, table_guess
from exograv.procedures.identification.identify import Identifier, identification_motion, identify_arm
from exograv.procedures.verification.change import changed_since, read_former
from exograv.procedures.verification.figures import verified_figures
from exograv.procedures.verification.options import VerifyOptions
from exograv.procedures.verification.verification import Verified, verify_arm
from exograv.recording.rounding import rounded
from exograv.rig.twin import Twin
from exograv.storage.self_test_pass import NOT_NEEDED

from .preparation import machine_of, pilot_of
from .truth_score import Examination
from .virtual_laboratory import VirtualLaboratory, draw_laboratory

LATER_SEED = 500_000
"""Added to the run's seed for a later verification: muscles and noise do not repeat themselves."""


def run_verification(options: VerifyOptions, progress: Progress) -> dict[str, Any]:
    """Run it; the result follows the contract of `exograv verify --json`.

    Raises:
        ConfigError: An option or a file cannot be used.
        ModelError: Machine or wearer cannot be modelled, or the workspace has no room for the postures.
        IdentificationError: The empty machine is not what it should be.
        RigError: The envelope stopped the run.
    """
    start = time.perf_counter()
    laboratory = draw_laboratory(options.rig, options.side, options.level, options.seed)
    refuse_motorless(laboratory.description)
    former = None if options.before is None else read_former(options.before, laboratory.description.name)
    assembly = laboratory.assembly()
    machine, t = machine_of(laboratory, options.level, options.seed, options.calibration, progress)
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, options.seed, t0=t)
    pilot = pilot_of(twin, machine.actuators, laboratory, progress)
    controller = ArmController(assembly, machine, table_guess(assembly, machine), twin.period_s)
    identifier = Identifier(pilot, controller, machine, "recursive", "current", lambda *_found: None)
    found = identify_arm(pilot, controller, identifier, MOTION_S)
    if options.later_min:
        pilot, controller = _later(options, laboratory, pilot, controller, found)
    seen = identification_motion(assembly, MOTION_S, 50 * twin.period_s).q
    verified = verify_arm(pilot, controller, identifier.model, found.last, seen, options.seed)
    truth = Examination(laboratory, assembly, machine, verified.postures).score(found.last.x).total
    result = _figures(options, laboratory, found, verified) | {"truth_Nm": rounded(truth)}
    if former is not None:
        result["before"] = changed_since(former, result)
    return {**result, "simulated_s": round(pilot.rig.t, 3), "wall_s": round(time.perf_counter() - start, 2)}


def _later(
    options: VerifyOptions,
    laboratory: VirtualLaboratory,
    pilot: Pilot,
    controller: ArmController,
    found: Identification,
) -> tuple[Pilot, ArmController]:
    """The same machine and person, the arm at the donning posture, after the machine has run for a while."""
    t0 = pilot.rig.t + 60.0 * options.later_min
    seed = LATER_SEED + options.seed
    twin = Twin(laboratory.description, laboratory.machine, laboratory.wearer, seed, t0=t0)
    fresh = pilot_of(twin, pilot.actuators, laboratory, pilot.progress)
    return fresh, controller.again(found.last.x)


def _figures(
    options: VerifyOptions, laboratory: VirtualLaboratory, found: Identification, verified: Verified
) -> dict[str, Any]:
    # On the twin the machine's clock stands for the wall's.
    at = datetime.now(UTC) + timedelta(minutes=options.later_min)
    return {
        "rig": laboratory.description.name,
        "disturbance_level": options.level,
        "seed": options.seed,
        "at_utc": at.isoformat(timespec="seconds"),
        **verified_figures(verified, laboratory.description.joints),
        "identification": {"motion_s": round(found.last.t, 3), "outcome": found.outcome.value},
        "self_test": NOT_NEEDED,
    }
