"""Result of a transparency test of one kind of machine: what the page shows and what `--json` writes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass


@dataclass(frozen=True)
class MachineEffort:
    """Muscle effort in one condition on one machine."""

    seed: int
    effort_Nms: float
    by_joint_Nms: Sequence[float]
    squared_N2m2s: float
    tracking_error_deg: Sequence[float]
    """By joint."""
    practice: int
    """Repetitions until the path was kept."""


@dataclass(frozen=True)
class ConditionEffort:
    """Medians over the machines in one condition."""

    effort_Nms: float
    by_joint_Nms: Sequence[float]
    tracking_error_deg: float
    """Of the worst joint."""
    squared_N2m2s: float
    machines: Sequence[MachineEffort]


@dataclass(frozen=True)
class EffortRatios:
    """Effort with the arm carried too over effort with the machine carried alone: medians over the machines [-]."""

    effort: float
    elbow: float
    squared: float
    beyond_zero_g: float
    """Share of what real weightlessness would have saved."""


@dataclass(frozen=True)
class OffPath:
    """Performance that did not keep the path."""

    condition: str
    seed: int
    tracking_error_deg: float


@dataclass(frozen=True)
class MachineTransparency:
    """Figures of one kind of machine."""

    rig: str
    profile: str
    """`harmonic` or `qdd`."""
    disturbance_level: int
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
