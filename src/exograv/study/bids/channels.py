"""Channels of a motion recording: columns of `_motion.tsv` in the terms of BIDS."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from .files import MISSING

Type = Literal["JNTANG", "MISC", "LATENCY", "POS", "ACCEL"]

COUNTED = (
    "ACCEL", "ANGACCEL", "GYRO", "JNTANG", "LATENCY", "MAGN", "MISC", "ORNT", "POS", "VEL",
)  # fmt: skip
"""Types that the sidecar counts separately."""

COLUMNS = (
    "name", "component", "type", "tracked_point", "units", "placement", "reference_frame", "description",
    "sampling_frequency",
)  # fmt: skip


@dataclass(frozen=True)
class MotionChannel:
    """Column of a motion recording in the terms of BIDS: name, component, type and unit."""

    name: str
    type: Type
    units: str
    description: str
    decimals: int
    """Decimals in the file."""

    tracked_point: str = MISSING
    component: str = MISSING
    reference_frame: str = MISSING

    def row(self, rate_Hz: float) -> dict[str, str | float]:
        """Return the row of `_channels.tsv`."""
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


LATENCY = MotionChannel("latency", "LATENCY", "s", "time of the measurement, since the first row", 6)
PER_TICK = (
    MotionChannel(
        "gravity_level", "MISC", MISSING, "share of the arm's own weight that is felt: 0 weightless, 1 Earth", 4
    ),
    MotionChannel("safe_state", "MISC", MISSING, "0: torque of the controller; k: safe state SSk-1 of the guard", 0),
)
"""Channels without filter, from the row's own tick."""


def filtered_channels(joints: Sequence[str]) -> list[MotionChannel]:
    """Return the channels of joints in the order of `FILTERED`, all joints of one quantity before the next quantity."""
    kinds: tuple[tuple[str, Type, str, str, int], ...] = (
        ("angle", "JNTANG", "deg", "joint angle from the encoder", 5),
        ("velocity", "MISC", "deg/s", "joint velocity as the controller used it", 4),
        ("torque_measured", "MISC", "N m", "torque of the motor, from current and calibration, or from a sensor", 5),
        ("torque_commanded", "MISC", "N m", "torque command of the motor", 5),
    )
    return [
        MotionChannel(f"{joint}_{name}", kind, units, description, decimals, joint)
        for name, kind, units, description, decimals in kinds
        for joint in joints
    ]


def exo_channels(joints: Sequence[str]) -> list[MotionChannel]:
    """Return all channels of the exoskeleton, in the order of columns."""
    return [LATENCY, *filtered_channels(joints), *PER_TICK]


def point_channels(name: str, kind: Type, units: str, description: str, frame: str) -> list[MotionChannel]:
    """Return latency and three axes of one point."""
    return [
        LATENCY,
        *(
            MotionChannel(f"{name}_{axis}", kind, units, f"{description}, {axis}", 5, name, axis, frame)
            for axis in "xyz"
        ),
    ]


def counts(channels: Sequence[MotionChannel]) -> dict[str, int]:
    """Return the numbers of channels and points for the sidecar."""
    points = {channel.tracked_point for channel in channels} - {MISSING}
    by_type = {f"{kind}ChannelCount": sum(channel.type == kind for channel in channels) for kind in COUNTED}
    return {"MotionChannelCount": len(channels), "TrackedPointsCount": len(points), **by_type}
