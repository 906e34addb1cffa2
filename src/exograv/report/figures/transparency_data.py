"""Result of a transparency test of one kind of machine, for the page and for `--json`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from exograv.options import WorldName


@dataclass(frozen=True)
class MachineEffort:
    """Muscle effort in one condition on one machine."""

    seed: int
    effort_Nms: float
    by_joint_Nms: Sequence[float]
    squared_N2m2s: float
    tracking_error_deg: Sequence[float]
    """RMS error of the path by joint [deg]."""
    practice: int
    """Number of repetitions until the arm followed the path."""


@dataclass(frozen=True)
class ConditionEffort:
    """Medians over the machines in one condition."""

    effort_Nms: float
    by_joint_Nms: Sequence[float]
    tracking_error_deg: float
    """RMS error of the path at the joint with the largest error [deg]."""
    squared_N2m2s: float
    machines: Sequence[MachineEffort]


@dataclass(frozen=True)
class EffortRatios:
    """Ratios of the effort with the arm carried too to that with only the machine carried; medians of machines [-]."""

    effort: float
    elbow: float
    squared: float
    beyond_zero_g: float
    """Ratio of the efforts beyond those in real weightlessness."""


@dataclass(frozen=True)
class OffPath:
    """Measured performance in which the arm left the prescribed path."""

    condition: str
    seed: int
    tracking_error_deg: float
    """RMS error of the path at the joint with the largest error [deg]."""


@dataclass(frozen=True)
class MachineTransparency:
    """Figures of one kind of machine."""

    rig: str
    profile: str
    """Kind of drive: `harmonic` or `qdd`."""
    disturbance_level: int
    world: WorldName
    seeds: Sequence[int]
    movement: str
    movement_s: float
    recorded_samples: int
    clipped_samples: int
    joints: Sequence[str]
    conditions: Mapping[str, ConditionEffort]
    dam_over_gcm: EffortRatios
    dam_minus_ideal_Nms: float
    off_path: Sequence[OffPath]
    tracking_error_max_deg: float
