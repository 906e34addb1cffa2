"""Traces around the opening of windows, as median over all windows of a session: felt level and speed of the joints."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from exograv.recording.fields import Message
from exograv.study.folder.columns import KEY, Column

MARGIN_S = 10.0
"""Margin before a window opens and after it closes; the ramp of the level in a training takes 7 s."""

STEP_S, LAST_S = 0.1, 32.0
TIMES_S = np.arange(-MARGIN_S, LAST_S + 0.5 * STEP_S, STEP_S)

TRACES = (
    *KEY,
    Column("t_s", "float64", "s", "time since the opening of a window"),
    Column("felt_level", "float64", "-", "median over windows of the felt share of weight, by machine "
           "or aircraft", is_nullable=True),
    Column("joint_speed_rad_per_s", "float64", "rad/s", "median over windows of the joints' speed (norm)",
           is_nullable=True),
)  # fmt: skip
"""Columns of the table `traces.parquet`."""

Sampled = Float[np.ndarray, " time"]


@dataclass(frozen=True)
class WindowTrace:
    """Trace of one window at `TIMES_S`; NaN where nothing was recorded."""

    level: Sampled
    speed: Sampled


def window_trace(
    opened_s: float,
    t: Float[np.ndarray, " tick"],
    q: Float[np.ndarray, "tick joint"],
    level: Float[np.ndarray, " tick"],
) -> WindowTrace:
    """Return the felt level and the rate of change of the posture at `TIMES_S`."""
    at = opened_s + TIMES_S
    around = opened_s + np.append(TIMES_S, TIMES_S[-1] + STEP_S) - 0.5 * STEP_S
    posture = np.column_stack([np.interp(around, t, joint, left=np.nan, right=np.nan) for joint in q.T])
    speed = np.linalg.norm(np.diff(posture, axis=0), axis=1) / STEP_S
    return WindowTrace(np.interp(at, t, level, left=np.nan, right=np.nan), speed)


def flown_levels(messages: Sequence[Message], opened_s: Sequence[float]) -> list[Sampled]:
    """Norm of the aircraft's acceleration around each opening [g]; empty without an aircraft."""
    if not messages:
        return []
    t = np.array([message["t"] for message in messages])
    g = np.linalg.norm([message["g"] for message in messages], axis=1)
    return [np.interp(opened + TIMES_S, t, g, left=np.nan, right=np.nan) for opened in opened_s]


def trace_rows(key: dict[str, Any], traces: Sequence[WindowTrace], flown: Sequence[Sampled]) -> list[dict[str, Any]]:
    """Return one row per time with medians over windows, by the aircraft if there is one; none without any data."""
    if not traces and not flown:
        return []
    level = _median(flown or [trace.level for trace in traces])
    speed = _median([trace.speed for trace in traces])
    values = zip(TIMES_S, level, speed, strict=True)
    return [
        {**key, "t_s": float(t), "felt_level": float(felt), "joint_speed_rad_per_s": float(fast)}
        for t, felt, fast in values
    ]


def _median(each: Sequence[Sampled]) -> Sampled:
    """Median of the traces that were recorded at that time."""
    found = np.full(len(TIMES_S), np.nan)
    if each:
        stacked = np.array(each)
        known = np.isfinite(stacked).any(0)
        found[known] = np.nanmedian(stacked[:, known], axis=0)
    return found
