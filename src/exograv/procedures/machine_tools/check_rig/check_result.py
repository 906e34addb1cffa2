"""Result of `exograv rig check`."""

from dataclasses import dataclass, field
from pathlib import Path

from exograv.report.figures.machine_data import TorqueRow
from exograv.results import OPTIONAL


@dataclass(frozen=True)
class SoftestFreedom:
    """Freedom of the arm that the cuffs hold with the lowest stiffness."""

    freedom: str
    Nm_per_rad: float


@dataclass(frozen=True)
class CuffStrain:
    """Largest strain of an unloaded cuff through the task workspace: 0 in a perfect fit."""

    stretch_mm: float
    turn_deg: float


@dataclass(frozen=True)
class ConditioningFigures:
    """Smallest over largest singular value of the joints' effect on the cuffs [-], and the nearest singular posture."""

    worst_in_task: float
    worst_at_deg: list[float]
    singular_beyond_task_deg: float | None
    singular_at_deg: list[float] | None


@dataclass(frozen=True)
class ReachedVolume:
    """Volume that one fingertip reaches."""

    side: str
    volume_m3: float
    furthest_m: float


@dataclass
class CheckResult:
    """Figures of a machine, as far as the check has come."""

    rig: str
    side: str | None = None
    rank: int | None = None
    """Number of freedoms of the arm that the cuffs determine."""
    human_dof: int | None = None
    unsupported: list[str] = field(default_factory=list)
    largest_arm_kg: float | None = None
    picture: Path | None = None
    softest: SoftestFreedom | None = field(default=None, metadata=OPTIONAL)
    loops: CuffStrain | None = field(default=None, metadata=OPTIONAL)
    conditioning: ConditioningFigures | None = field(default=None, metadata=OPTIONAL)
    workspace: list[ReachedVolume] | None = field(default=None, metadata=OPTIONAL)
    wearer_arm_kg: float | None = field(default=None, metadata=OPTIONAL)
    torque_Nm: list[TorqueRow] | None = field(default=None, metadata=OPTIONAL)
    ok: bool = False
    problems: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
