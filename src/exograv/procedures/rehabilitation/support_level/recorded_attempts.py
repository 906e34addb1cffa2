"""Attempts in a recording: their support, their target, and if the fingertip stayed there long enough."""

import itertools
from pathlib import Path
from typing import Any

import numpy as np

from exograv.errors import RecordingError
from exograv.recording import read_topics

from .targets import TARGETS, ReachJudge

SUPPORTS_LEAST = 2
"""Different supports that a recording must contain for an estimate."""

WHAT_IT_TAKES = (
    "A recording for this holds, for each attempt, two messages on /task of kind reach_began (with target, targets, "
    "support as a share of the arm's weight, and place_m in the base frame) and reach_ended, and /skeleton between "
    "them, with at least two different supports; `exograv run support-level` writes such recordings "
    "(docs/howto/support_level.md)."
)


def recorded_attempts(path: Path) -> tuple[list[tuple[int, float, bool]], bool]:
    """Return target, support [share of the weight] and success of each attempt, and True if the recording is simulated.

    Success is judged again, by the fingertip's positions.

    Raises:
        RecordingError: The file cannot be read, or does not contain suitable attempts.
    """
    recording = read_topics(path, ("/task", "/skeleton"))
    task = [message for message in recording.messages("/task") if message["kind"] in ("reach_began", "reach_ended")]
    if not task:
        raise RecordingError(f"{path} contains no attempts at targets. {WHAT_IT_TAKES}")
    poses = [(one["t"], one["arm"][-1]) for one in recording.messages("/skeleton")]
    times, tips = np.array([t for t, _ in poses]), [tip for _, tip in poses]
    tried: list[tuple[int, float, bool]] = []
    for began, ended in itertools.pairwise(task):
        if (began["kind"], ended["kind"]) != ("reach_began", "reach_ended"):
            continue
        record = _checked(path, began["record"])
        judge = ReachJudge(np.array(record["place_m"], dtype=float))
        first, last = np.searchsorted(times, [began["t"], ended["t"]], side="right")
        for k in range(int(first), int(last)):
            judge.see(float(times[k]), tips[k])
        tried.append((int(record["target"]), float(record["support"]), judge.reached))
    supports = {support for _, support, _ in tried}
    if len(supports) < SUPPORTS_LEAST:
        raise RecordingError(
            f"{path} contains {len(tried)} complete attempts at {len(supports)} support; {SUPPORTS_LEAST} supports are "
            f"needed. {WHAT_IT_TAKES}"
        )
    return tried, recording.is_simulated


def _checked(path: Path, record: dict[str, Any]) -> dict[str, Any]:
    missing = [name for name in ("target", "targets", "support", "place_m") if name not in record]
    if missing:
        raise RecordingError(f"{path}: an attempt lacks {', '.join(missing)}. {WHAT_IT_TAKES}")
    if record["targets"] != len(TARGETS) or not 0 <= record["target"] < len(TARGETS):
        raise RecordingError(
            f"{path}: target {record['target']} of {record['targets']}; the set has {len(TARGETS)}. {WHAT_IT_TAKES}"
        )
    if not 0.0 <= record["support"] <= 1.0:
        raise RecordingError(f"{path}: support {record['support']}; allowed: 0 to 1. {WHAT_IT_TAKES}")
    return record
