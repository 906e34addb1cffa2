"""One verification on a worn machine, real or virtual: fly the passes, and say what is left over."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.identification.core.arm_model import ArmModel
from exograv.identification.core.interface import Estimate
from exograv.identification.core.left_over import REJECTED_MAX, RESTLESS
from exograv.identification.core.prior import prior
from exograv.loop.arm_controller import ArmController
from exograv.loop.person_limits_manager import PersonLimitsManager
from exograv.loop.pilot import Pilot, Progress
from exograv.study.targets import TARGET_NM

from .estimate import ENDS, LeftOver, LeftOverEstimator
from .fingertip import Fingertip
from .postures import Postures, unseen_postures
from .slow_passes import PassSample, fly_passes

RESTLESS_TEXT = "The person does not relax: what is left over cannot be told from muscles. Ask to let go, then repeat."


@dataclass(frozen=True)
class VerificationResult:
    """What a verification found."""

    postures: Postures
    """[rad]"""

    left_over: LeftOver
    rms: Float[np.ndarray, "3 joint"]
    """Left over, RMS over the postures: median and ends of its 95 % interval [N·m]."""

    fingertip_mm: Float[np.ndarray, " 3"]
    """How far it moves an unseen fingertip, RMS over the postures: the same three."""

    targets: Float[np.ndarray, " joint"]
    """Of what is left over [N·m]."""

    motion_s: float

    @property
    def is_relaxed(self) -> bool:
        """Whether the person let go."""
        return self.left_over.noise_scale <= RESTLESS and self.left_over.rejected_share <= REJECTED_MAX

    def why(self, joints: tuple[str, ...]) -> str:
        """The verdict, as a sentence for the operator."""
        if not self.is_relaxed:
            return RESTLESS_TEXT
        _, low, high = self.rms
        beyond, unsure = low > self.targets, (low <= self.targets) & (high > self.targets)
        if beyond.any():
            return f"More than its target is left over at {_named(joints, beyond)}. Identify the arm again."
        if unsure.any():
            return (
                f"Nothing is surely beyond its target; {_named(joints, unsure)} may be. "
                "A longer identification or another verification tells more."
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
    """Fly the passes with a relaxed person, and tell what is left over of the arm as it is carried.

    Args:
        pilot: On the worn machine.
        controller: Of the arm; it drives afterwards.
        model: Of this arm in the machine as calibrated.
        arm: As identified, and as carried.
        seen: Where the identification's motion led [rad].
        seed: Of the postures.

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
    """What is left over by passes that have been flown.

    Args:
        model: Of this arm in the machine as calibrated.
        arm: As identified, and as carried.
        postures: That were passed [rad].
        heard: In the passes.
        seconds: That they took [s].
        progress: Told now and then.
    """
    progress("Telling what is left over from what muscles do", 0.0)
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
