"""Targets below which an arm counts as weightless, and the groups of joints that are judged together."""

import numpy as np

from exograv.recording import Recording

# A left-over torque of 0.5 N·m moves an unseen fingertip by 5–15 mm (from an assumed stiffness), which is the size of
# human proprioceptive scatter. These targets stay well below 0.5 N·m.
TARGET_SHOULDER_NM = 0.2
TARGET_ELBOW_NM = 0.1
TARGET_WRIST_NM = 0.05  # of the hand's 0.3 N·m about the wrist, a share similar to the elbow's target of 2.9 N·m
TARGET_NM = {"shoulder": TARGET_SHOULDER_NM, "elbow": TARGET_ELBOW_NM, "wrist": TARGET_WRIST_NM}
"""Targets by part of the arm [N·m]."""

SIDES = ("right", "left")


def target_of(joint: str) -> float:
    """Return the target of a joint by the part of the arm in its name [N·m]; forearm roll has that of the wrist."""
    return next((target for place, target in TARGET_NM.items() if place in joint), TARGET_WRIST_NM)


def targets(recording: Recording) -> np.ndarray:
    """Largest left over (joint,) that counts as weightless [N·m]: the recording's own, else the project's."""
    if own := recording.settings.get("targets_Nm"):
        return np.array(own)
    return np.array([target_of(joint) for joint in recording.joints])


def joint_groups(joints: tuple[str, ...]) -> dict[str, list[int]]:
    """Return the indices of the joints of each part of the arm, by the first word of the joints' names.

    In a machine for both arms the first word is the side, and the part has two words, such as "right shoulder".
    """
    groups: dict[str, list[int]] = {}
    for index, joint in enumerate(joints):
        words = joint.split("_")
        groups.setdefault(" ".join(words[: 2 if words[0] in SIDES else 1]), []).append(index)
    return groups
