"""Sentences for the operator: check of an identification, cuffs that have slipped, arm that is carried in part."""

from collections.abc import Sequence

import numpy as np

from exograv.identification.core.carried_arm import CarriedArm
from exograv.identification.core.interface import Agreement, Estimate, Joints, Outcome
from exograv.identification.core.left_over import TARGET_NM
from exograv.model.description import RigDescription

from .check_motion import CHECKED_FROM_S
from .controller_knowledge import MOTION_S

SLIP_SHARE = 0.5
"""Share of a target from which the torque of slipped cuffs is mentioned [-]."""

SHOWN_SHARE = 0.995
"""Share from which an axis is shown as carried in full [-]."""


def check_text(outcome: Outcome, agreement: Agreement | None, joints: Sequence[str]) -> str:
    """State the result of the check, and the next step if it disagrees, or if only the check is missing."""
    if agreement is None:
        if outcome is not Outcome.UNCHECKED:
            return ""
        return f"A motion of {CHECKED_FROM_S:.0f} s or more by the method 'recursive' ends with a check."
    found, right = (", ".join(f"{value:.2f}" for value in each) for each in (agreement.residual, agreement.expected))
    text = f"Residual torque at unused postures: {found} N·m; a right estimate leaves about {right} N·m."
    if agreement.holds:
        return text
    worst = int(agreement.p.argmin())
    share = f"{100 * agreement.p[worst]:.2g} %"
    return (
        f"{text} Joint {joints[worst]} disagrees: a right estimate leaves that much in {share} of checks. "
        "Check the cuffs, ask the person to relax, then identify again with a longer motion."
    )


def slip_text(estimate: Estimate, by_slip: Joints, description: RigDescription) -> str:
    """State the slip of the cuffs if its torque matters, and the next step."""
    target = np.array([TARGET_NM[place] for place in description.places])
    worst = int((by_slip / target).argmax())
    if estimate.slipped is None or by_slip[worst] < SLIP_SHARE * target[worst]:
        return ""
    return (
        f"The cuffs slip along the limb by {1e3 * estimate.slipped.max():.0f} mm, which leaves "
        f"{by_slip[worst]:.2f} N·m at {description.joints[worst]}. Fasten them tighter, then repeat."
    )


def carried_text(carried: CarriedArm, joints: Sequence[str], motion_s: float) -> str:
    """State on which axes the machine carries only a part of the estimate, why, and the next step; "" if on none."""
    if carried.is_whole:
        return ""
    axes = [_axis_text(carried, j, joint) for j, joint in enumerate(joints) if carried.share[j] < SHOWN_SHARE]
    longer = f"Identify again with a motion of {MOTION_S:.0f} s or more."
    better = "Check the cuffs, ask the person to relax, then identify again with a longer motion."
    return " ".join(
        [
            "The arm floats on a part of the estimate, because the body table may fit it better.",
            *axes,
            longer if motion_s < MOTION_S - 1.0 else better,
        ]
    )


def _axis_text(carried: CarriedArm, j: int, joint: str) -> str:
    share = f"{100 * carried.share[j]:.0f} % of the change is carried."
    if carried.stated_Nm[j] > carried.table_Nm[j]:
        return (
            f"{joint}: the estimate may leave {carried.stated_Nm[j]:.2f} N·m over, the table "
            f"{carried.table_Nm[j]:.2f} N·m; {share}"
        )
    return (
        f"{joint}: the estimate changes the table's torque by {carried.change_Nm[j]:.2f} N·m and may be wrong by "
        f"{carried.bound_Nm[j]:.2f} N·m; {share}"
    )
