"""Recorded points as tracking systems: the hand from the model of the arm, and the aircraft."""

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
"""Frame of the exoskeleton's base."""

FRAMES = {
    BASE: {
        "Description": "base of the exoskeleton: x forward, y left, z up",
        "SpatialAxes": "ALS",
        "RotationOrder": MISSING,
        "RotationRule": "right-hand",
    },
    AIRCRAFT: {
        "Description": "axes of the aircraft, as in its own feed, which does not state their directions",
        "SpatialAxes": MISSING,
        "RotationOrder": MISSING,
        "RotationRule": "right-hand",
    },
}
POINTS = {
    "/skeleton": (HAND, BASE, point_channels("hand", "POS", "m", "end of the model of the worn arm", BASE)),
    "/aircraft": (
        AIRCRAFT, AIRCRAFT, point_channels("cabin", "ACCEL", "m/s^2", "acceleration as in the feed", AIRCRAFT),
    ),
}  # fmt: skip
"""Tracking system, frame and channels, by topic of the recording."""


@dataclass
class TrackFile:
    """Tracking system while its file is written."""

    topic: str
    t: list[float] = field(default_factory=list)
    points: list[Sequence[float]] = field(default_factory=list)

    def take(self, message: Mapping[str, Any]) -> None:
        """Take one message of the topic. A message that is not later than the last one is left out."""
        if self.t and message["t"] <= self.t[-1]:
            return
        point = message["arm"][-1] if self.topic == "/skeleton" else [EARTH_M_S2 * g for g in message["g"]]
        self.t.append(message["t"])
        self.points.append(point)

    def write(
        self, root: Path, place: SessionPlace, first_t: float, about: Mapping[str, Any]
    ) -> tuple[PurePosixPath, float]:
        """Write the files of the tracking system.

        Returns:
            Motion file from the root, and its beginning after the exoskeleton's [s].
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
        "RowsAre": "as received; missing rows show as a jump of the latency",
        "StartTime": round(starts, 6),
        **counts(channels),
    }


def tracks() -> Iterator[TrackFile]:
    """Return one empty track for each topic that a recording may have."""
    return (TrackFile(topic) for topic in POINTS)
