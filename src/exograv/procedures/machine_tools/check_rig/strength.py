"""Heaviest arm that the drives hold in every posture of the task, with 1 kg in the hand and friction."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.dynamics.carrying import CarriedTorque, carried
from exograv.identification.calibration.empty_machine import COULOMB
from exograv.model.assembly import Assembly
from exograv.model.description import RigDescription
from exograv.model.loops import LoopSolver
from exograv.model.support import sample_postures

from .findings import CheckFindings

POSTURES = 64
BREAKAWAY = 1.3
"""Breakaway over Coulomb friction, in a good laboratory (docs/explanation/disturbances.md, level 2)."""
HAND_KG = 1.0
LIGHTEST_KG = 2.02
"""Arm mass of a woman of 45 kg by the table: the lightest adult that the twin draws."""
ARM_MAX_KG = 100.0  # reported where the arm loads no joint

Joints = Float[np.ndarray, " joint"]


@dataclass(frozen=True)
class DriveStrength:
    """Peak torque of each drive, and the torques by machine, arm, 1 kg in the hand and friction that it must hold."""

    largest_arm_kg: float
    limited_by: str
    """Joint whose drive reaches its limit first."""

    limit: Joints
    """Peak torque; NaN without a motor [N·m]."""

    exo: Joints
    """Torque by the machine's links, in the posture in which the joint is loaded most [N·m]."""
    arm: Joints
    """Torque by this wearer's arm [N·m]."""
    hand: Joints
    """Torque by 1 kg in the hand [N·m]."""
    friction: Joints
    """Breakaway torque [N·m]."""


def strength(assembly: Assembly, solver: LoopSolver) -> DriveStrength:
    """Return the strength of the drives over the task workspace."""
    description = assembly.description
    found = carried(assembly, sample_postures(description, POSTURES), solver)
    friction = friction_reserve(description)
    limit = description.per_actuator("torque_max_Nm")
    shares = largest_shares(found, friction, limit)
    weakest = int(np.argmin(shares))
    one_arm = float(assembly.arm.phi.reshape(-1, 10)[:, 0].sum()) / len(assembly.arm.limbs)
    # Columns are joints, each in the posture with its largest total torque.
    parts = np.stack([found.exo, found.arm, HAND_KG * found.hand])
    worst = np.argmax(np.abs(parts.sum(axis=0)), axis=0)
    exo, arm, hand = parts[:, worst, np.arange(assembly.n)]
    motors = np.isfinite(limit).any()
    return DriveStrength(
        min(float(shares[weakest]) * one_arm, ARM_MAX_KG) if motors else 0.0,
        description.joints[weakest] if motors else "",
        limit,
        exo,
        arm,
        hand,
        friction,
    )


def friction_reserve(description: RigDescription) -> Joints:
    """Torque that a drive of this kind needs to break away [N·m]; zero without a drive."""
    drives = [actuator.drive for actuator in description.settings.actuators]
    return np.array([0.0 if drive == "passive" else BREAKAWAY * COULOMB[drive][0] for drive in drives])


def largest_shares(found: CarriedTorque, friction: Joints, limit: Joints) -> Joints:
    """Multiples of this arm that each drive holds in its worst posture.

    Infinite without a motor, zero if the drive does not hold even 1 kg. The share is the largest that meets

        |exo + hand + share · arm| + friction ≤ limit.
    """
    others, room = found.exo + HAND_KG * found.hand, limit - friction
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = (np.sign(found.arm) * room - others) / found.arm
    # A joint that the arm does not load, such as a vertical one, holds any arm if it holds the other loads.
    shares = np.where(np.abs(found.arm) < 1e-9, np.inf, shares)
    shares = np.where(np.abs(others) > room, 0.0, shares)
    return np.where(np.isnan(limit), np.inf, np.maximum(shares, 0.0).min(axis=0))


def examine_strength(description: RigDescription, arm_kg: float, found: DriveStrength, findings: CheckFindings) -> None:
    """Report drives that are too weak for any adult as a problem, and for this wearer as a note."""
    if not np.isfinite(found.limit).any():
        findings.note("no joint has a motor: the machine cannot carry an arm or itself.")
        return
    able = f"the drives hold an arm of {found.largest_arm_kg:.1f} kg with 1 kg in the hand"
    if found.largest_arm_kg < LIGHTEST_KG:
        findings.problem(
            f"{able}; the lightest adult's weighs {LIGHTEST_KG} kg. '{found.limited_by}' reaches its limit first: "
            "give it a stronger drive or a larger gear, or shrink the task workspace."
        )
    elif found.largest_arm_kg < arm_kg:
        findings.note(f"{able}; this wearer's weighs {arm_kg:.1f} kg. '{found.limited_by}' reaches its limit first.")
    for joint, share, has_motor in zip(
        description.joints, np.abs(found.exo + found.arm), np.isfinite(found.limit), strict=True
    ):
        if not has_motor:
            findings.note(
                f"'{joint}' has no motor: up to {share:.1f} N·m of weight at this joint stay with the wearer."
            )
