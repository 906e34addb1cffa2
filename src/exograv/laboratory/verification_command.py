"""`exograv verify` on the twin: the machine calibrated, the arm identified, and then what is left over where."""

import time
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import ConfigError
from exograv.loop.arm_controller import ArmController
from exograv.loop.pilot import Pilot, Progress
from exograv.model.description import Side
from exograv.procedures.identification.estimator_session import Identification, table_guess
from exograv.procedures.identification.identify import Identifier, identification_motion, identify_arm
from exograv.procedures.verification.change import changed_since, read_former
from exograv.procedures.verification.verification import Verified, verify_arm
from exograv.rig.twin import Twin
from exograv.storage.self_test_pass import NOT_NEEDED

from .preparation import MOTION_S, machine_of, pilot_of
from .result_rows import rounded
from .truth_score import Examination
from .virtual_laboratory import VirtualLaboratory, draw_laboratory, refuse_motorless

LATER_MAX_MIN = 240.0
LATER_SEED = 500_000
"""Added to the run's seed for a later verification: muscles and noise do not repeat themselves."""


@dataclass(frozen=True)
class VerifyOptions:
    """What `exograv verify` is asked for."""

    rig: str = "recupera_like"
    side: Side | None = None
    level: int = 2
    seed: int = 0
    calibration: Path | None = None
    before: Path | None = None
    """Figures of a former verification, to say what changed."""
    later_min: float = 0.0
    """That the machine runs between identification and verification [min]."""

    def __post_init__(self):
        if not 0 <= self.level <= 4:
            raise ConfigError(f"--level is {self.level}; allowed: 0 (none) to 4 (a bad day).")
        if self.seed < 0:
            raise ConfigError(f"--seed is {self.seed}; allowed: 0 and above.")
        if not 0.0 <= self.later_min <= LATER_MAX_MIN:
            raise ConfigError(f"--later is {self.later_min:g} min; allowed: 0 to {LATER_MAX_MIN:g} min.")


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


def verified_figures(verified: Verified, joints: tuple[str, ...]) -> dict[str, Any]:
    """What the passes tell."""
    median, low, high = verified.rms
    return {
        "joints": list(joints),
        "left_over_Nm": rounded(median),
        "ci95": [rounded(np.array(ends)) for ends in zip(low, high, strict=True)],
        "target_Nm": rounded(verified.targets),
        "fingertip_mm": round(float(verified.fingertip_mm[0]), 2),
        "fingertip_ci95_mm": [round(float(end), 2) for end in verified.fingertip_mm[1:]],
        "postures": _rows(verified),
        "relaxed": verified.is_relaxed,
        "noise_scale": round(verified.left_over.noise_scale, 3),
        "rejected_share": round(verified.left_over.rejected_share, 4),
        "why": verified.why(joints),
        "motion_s": round(verified.motion_s, 1),
    }


def _rows(verified: Verified) -> list[dict[str, Any]]:
    """One a posture."""
    found = verified.left_over
    columns = {
        "deg": np.rad2deg(verified.postures),
        "left_over_Nm": found.draws.mean(axis=0),
        "sd_Nm": found.draws.std(axis=0),
        "beyond_Nm": found.beyond,
        "beyond_sd_Nm": found.beyond_sd,
    }
    return [{name: rounded(values[k]) for name, values in columns.items()} for k in range(len(verified.postures))]
