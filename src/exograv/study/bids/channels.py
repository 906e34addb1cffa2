"""Channels of a motion recording: what a column of `_motion.tsv` is, by the words that BIDS has for it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .files import MISSING

Type = Literal["JNTANG", "MISC", "LATENCY", "POS", "ACCEL"]

COUNTED = (
    "ACCEL", "ANGACCEL", "GYRO", "JNTANG", "LATENCY", "MAGN", "MISC", "ORNT", "POS", "VEL",
)  # fmt: skip
"""Types that the sidecar counts, each by itself."""

COLUMNS = (
    "name", "component", "type", "tracked_point", "units", "placement", "reference_frame", "description",
    "sampling_frequency",
)  # fmt: skip


@dataclass(frozen=True)
class MotionChannel:
    """A column of numbers."""

    name: str
    type: Type
    units: str
    description: str
    decimals: int
    """Kept in the file."""

    tracked_point: str = MISSING
    component: str = MISSING
    reference_frame: str = MISSING

    def row(self, rate_Hz: float) -> dict[str, str | float]:
        """Of `_channels.tsv`."""
        return {
            "name": self.name,
            "component": self.component,
            "type": self.type,
            "tracked_point": self.tracked_point,
            "units": self.units,
            "reference_frame": self.reference_frame,
            "description": self.description,
            "sampling_frequency": rate_Hz,
        }


LATENCY = MotionChannel("latency", "LATENCY", "s", "when it was measured, since the first row", 6)
PER_TICK = (
    MotionChannel("gravity_level", "MISC", MISSING, "share of the arm's own weight that the machine leaves", 4),
    MotionChannel("safe_state", "MISC", MISSING, "0: control's own torque; k: safe state SSk-1 of the guard", 0),
)
"""Unfiltered, of the row's own tick."""


def filtered_channels(joints: Sequence[str]) -> list[MotionChannel]:
    """Those of joints, in the order of `FILTERED`, all joints of one before the next."""
    kinds: tuple[tuple[str, Type, str, str, int], ...] = (
        ("angle", "JNTANG", "deg", "joint angle by the encoder", 5),
        ("velocity", "MISC", "deg/s", "joint velocity as control used it", 4),
        ("torque_measured", "MISC", "N m", "torque that the motor adds, by current and calibration, or a sensor", 5),
        ("torque_commanded", "MISC", "N m", "torque that the motor was told to add", 5),
    )
    return [
        MotionChannel(f"{joint}_{name}", kind, units, description, decimals, joint)
        for name, kind, units, description, decimals in kinds
        for joint in joints
    ]


def exo_channels(joints: Sequence[str]) -> list[MotionChannel]:
    """All of the exoskeleton, in the order of columns."""
    return [LATENCY, *filtered_channels(joints), *PER_TICK]


def point_channels(name: str, kind: Type, units: str, description: str, frame: str) -> list[MotionChannel]:
    """Three axes of one point."""
    return [
        LATENCY,
        *(
            MotionChannel(f"{name}_{axis}", kind, units, f"{description}, {axis}", 5, name, axis, frame)
            for axis in "xyz"
        ),
    ]


def counts(channels: Sequence[MotionChannel]) -> dict[str, int]:
    """What the sidecar counts."""
    points = {channel.tracked_point for channel in channels} - {MISSING}
    by_type = {f"{kind}ChannelCount": sum(channel.type == kind for channel in channels) for kind in COUNTED}
    return {"MotionChannelCount": len(channels), "TrackedPointsCount": len(points), **by_type}
