"""Advice to the operator: the joint that is known least, and how the arm is learned better."""

from collections.abc import Sequence

from exograv.identification.core.left_over import TARGET_NM
from exograv.model.rig_settings import Place
from exograv.sentence import Sentence

from .sentences import say


def learning_help(
    joints: Sequence[str], places: Sequence[Place], left_over_Nm: Sequence[float], is_over: bool
) -> tuple[str | None, Sentence]:
    """Return the joint farthest above its target, and what the operator may do; None if all are within their targets.

    Args:
        joints: Names of the joints.
        places: Place of each joint, which sets its target.
        left_over_Nm: Predicted residual torque per joint.
        is_over: True if the motion is over.
    """
    ratio, joint, place, left_over = max(
        (value / TARGET_NM[place], joint, place, value)
        for joint, place, value in zip(joints, places, left_over_Nm, strict=True)
    )
    if ratio <= 1.0:
        return None, say("learning.reached")
    numbers = {"left_over": f"{left_over:.2f}", "target": f"{TARGET_NM[place]:.3g}"}
    return joint, say("learning.again" if is_over else "learning.relax", **numbers)
