"""What was recorded of a point, as a tracking system of its own: the hand by the model of the arm, the aircraft."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from .channels import MotionChannel, counts, point_channels
from .files import MISSING, number_rows, write_json
from .motion import write_channels
from .names import AIRCRAFT, HAND, SessionPlace

EARTH_M_S2 = 9.80665
BASE = "base"
"""Frame of the exoskeleton."""

FRAMES = {
    BASE: {
        "Description": "base of the exoskeleton: x forward, y left, z up",
        "SpatialAxes": "ALS",
        "RotationOrder": MISSING,
        "RotationRule": "right-hand",
    },
    AIRCRAFT: {
        "Description": "axes of the aircraft, as its own feed has them; their directions are not told there",
        "SpatialAxes": MISSING,
        "RotationOrder": MISSING,
        "RotationRule": "right-hand",
    },
}
POINTS = {
    "/skeleton": (HAND, BASE, point_channels("hand", "POS", "m", "end of the model of the worn arm", BASE)),
    "/aircraft": (
        AIRCRAFT, AIRCRAFT, point_channels("cabin", "ACCEL", "m/s^2", "acceleration as the feed tells it", AIRCRAFT),
    ),
}  # fmt: skip
"""Tracking system, frame and channels of a channel of the recording."""


@dataclass
class TrackFile:
    """One tracking system while it is written."""

    topic: str
    t: list[float] = field(default_factory=list)
    points: list[Sequence[float]] = field(default_factory=list)

    def take(self, message: Mapping[str, Any]) -> None:
        """One message of the topic; one that is not later than the last is left out."""
        if self.t and message["t"] <= self.t[-1]:
            return
        point = message["arm"][-1] if self.topic == "/skeleton" else [EARTH_M_S2 * g for g in message["g"]]
        self.t.append(message["t"])
        self.points.append(point)

    def write(
        self, root: Path, place: SessionPlace, first_t: float, about: Mapping[str, Any]
    ) -> tuple[PurePosixPath, float]:
        """Write its files.

        Returns:
            The motion file from the root, and when it begins after the exoskeleton's [s].
        """
        system, frame, channels = POINTS[self.topic]
        t, points = np.array(self.t), np.array(self.points)
        starts = float(t[0] - first_t)
        table = place.motion(system, "motion.tsv")
        (root / table).parent.mkdir(parents=True, exist_ok=True)
        columns = [t - t[0], *points.T]
        (root / table).write_bytes(number_rows(columns, [channel.decimals for channel in channels]))
        rate = float(np.round(1.0 / np.median(np.diff(t)))) if len(t) > 1 else 1.0
        write_channels(root, place, system, channels, rate)
        write_json(
            root / place.motion(system, "channels.json"), {"reference_frame": {"Levels": {frame: FRAMES[frame]}}}
        )
        write_json(root / place.motion(system, "motion.json"), {**about, **_sidecar(system, t, rate, starts, channels)})
        return table, starts


def _sidecar(
    system: str, t: np.ndarray, rate: float, starts: float, channels: Sequence[MotionChannel]
) -> dict[str, Any]:
    span = float(t[-1] - t[0])
    return {
        "TrackingSystemName": system,
        "ManufacturersModelName": MISSING,
        "SamplingFrequency": rate,
        "SamplingFrequencyEffective": round((len(t) - 1) / span, 6) if span > 0.0 else MISSING,
        "MissingValues": MISSING,
        "RowCount": len(t),
        "RecordingDuration": round(span, 6),
        "RowsAre": "as they came; where some are missing the latency leaps",
        "StartTime": round(starts, 6),
        **counts(channels),
    }


def tracks() -> Iterator[TrackFile]:
    """One for each that a recording may have."""
    return (TrackFile(topic) for topic in POINTS)
