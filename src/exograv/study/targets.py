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


def targets(recording: Recording) -> np.ndarray:
    """Largest left over (joint,) that counts as weightless [N·m]: the recording's own, else the project's."""
    if own := recording.settings.get("targets_Nm"):
        return np.array(own)
    return np.array([TARGET_ELBOW_NM if "elbow" in joint else TARGET_SHOULDER_NM for joint in recording.joints])


def joint_groups(joints: tuple[str, ...]) -> dict[str, list[int]]:
    """Return the indices of the joints of each part of the arm, by the first word of the joints' names."""
    groups: dict[str, list[int]] = {}
    for index, joint in enumerate(joints):
        groups.setdefault(joint.split("_")[0], []).append(index)
    return groups
