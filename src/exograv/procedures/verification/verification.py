"""Verification on a worn machine, real or virtual: the passes are flown, and the left over is estimated."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import RESTLESS, Estimate
from exograv.identification.core.left_over import REJECTED_MAX
from exograv.identification.core.prior import prior
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.pilot import Pilot, Progress
from exograv.study.targets import TARGET_NM

from .estimate import ENDS, LeftOver, LeftOverEstimator
from .fingertip import Fingertip
from .postures import Postures, unseen_postures
from .slow_passes import PassSample, fly_passes

RESTLESS_TEXT = (
    "The person does not relax: the left over cannot be separated from muscle torque. Ask the person to relax, then "
    "repeat."
)


@dataclass(frozen=True)
class VerificationResult:
    """Result of a verification."""

    postures: Postures
    """Postures that were passed [rad]."""

    left_over: LeftOver
    rms: Float[np.ndarray, "3 joint"]
    """Left over, RMS over the postures: median and ends of its 95 % interval [N·m]."""

    fingertip_mm: Float[np.ndarray, " 3"]
    """Displacement of an unseen fingertip, RMS over the postures: median and ends of its 95 % interval [mm]."""

    targets: Float[np.ndarray, " joint"]
    """Targets of the left over [N·m]."""

    motion_s: float

    @property
    def is_relaxed(self) -> bool:
        """True if the person relaxed."""
        return self.left_over.noise_scale <= RESTLESS and self.left_over.rejected_share <= REJECTED_MAX

    def why(self, joints: tuple[str, ...]) -> str:
        """Return the verdict as a sentence for the operator."""
        if not self.is_relaxed:
            return RESTLESS_TEXT
        _, low, high = self.rms
        beyond, unsure = low > self.targets, (low <= self.targets) & (high > self.targets)
        if beyond.any():
            return f"The left over exceeds its target at {_named(joints, beyond)}. Identify the arm again."
        if unsure.any():
            return (
                f"No joint surely exceeds its target; {_named(joints, unsure)} may exceed it. "
                "Use a longer identification or another verification to decide."
            )
        return "Every joint is surely within its target."


def verify_arm(
    pilot: Pilot,
    controller: ArmController,
    model: ArmModel,
    arm: Estimate,
    seen: Float[np.ndarray, "tick joint"],
    seed: int,
) -> VerificationResult:
    """Fly the passes with a relaxed person, and estimate the left over of the arm as it is carried.

    Args:
        pilot: Pilot of the worn machine.
        controller: Controller of the arm; it drives the arm afterwards, too.
        model: Model of this arm in the machine as calibrated.
        arm: Arm as identified and carried.
        seen: Postures of the identification's motion [rad].
        seed: Seed of the postures.

    Raises:
        ModelError: The task workspace has no room for the postures.
        RigError: The envelope stopped the run.
    """
    postures = unseen_postures(model.again(), arm.x, seen, seed)
    if pilot.worn is None:
        pilot.worn = PersonLimitsManager(
            pilot.envelope, model.assembly, model.machine, prior(model.assembly, model.machine)[0]
        )
        pilot.worn.know(arm.x)
    start = pilot.rig.t
    heard = fly_passes(pilot, controller, postures, seed)
    return evaluate_passes(model, arm, postures, heard, pilot.rig.t - start, pilot.progress)


def evaluate_passes(
    model: ArmModel, arm: Estimate, postures: Postures, heard: Sequence[PassSample], seconds: float, progress: Progress
) -> VerificationResult:
    """Estimate the left over from passes that have been flown.

    Args:
        model: Model of this arm in the machine as calibrated.
        arm: Arm as identified and carried.
        postures: Postures that were passed [rad].
        heard: Samples of the passes.
        seconds: Duration of the passes [s].
        progress: Called with the progress.
    """
    progress("Separating what is left over from muscle torque", 0.0)
    found = LeftOverEstimator(model, arm, postures).estimate(heard, progress)
    moved_mm = Fingertip(model, arm.x, postures).moved_mm(found.draws)
    targets = np.array([TARGET_NM[place] for place in model.assembly.description.places])
    return VerificationResult(
        postures,
        found,
        found.rms,
        _middle_and_ends(np.sqrt(np.mean(moved_mm**2, axis=1)), bool(found.excludes_nothing.any())),
        targets,
        seconds,
    )


def _middle_and_ends(values: Float[np.ndarray, " draw"], excludes_nothing: bool) -> Float[np.ndarray, " 3"]:
    middle, low, high = np.quantile(values, (0.5, *ENDS))
    return np.array([middle, low if excludes_nothing else 0.0, high])


def _named(joints: tuple[str, ...], which: np.ndarray) -> str:
    return ", ".join(joint for joint, is_one in zip(joints, which, strict=True) if is_one)
