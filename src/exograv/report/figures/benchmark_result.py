"""Result of the benchmark of identification methods, for the command's files, the page and the figure."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

Ends = tuple[float | None, float | None]
"""Ends of a 95 % interval; None for an infinite end."""


@dataclass(frozen=True)
class MedianFigures:
    """Median over wearers with its bootstrap interval; None for infinite values."""

    median: float | None
    ci95: Ends


@dataclass(frozen=True)
class Coverage:
    """Number of stated 95 % intervals that hold the true value."""

    covered: int
    of: int


@dataclass(frozen=True)
class PlaceFigures:
    """Worst axis of each place [N·m]; None if infinite."""

    shoulder: float | None
    elbow: float | None


@dataclass(frozen=True)
class TimePercentiles:
    """Medians over the wearers of each run's percentiles, and the overall maximum [µs]."""

    p50: float | None = None
    p99: float | None = None
    max: float | None = None


@dataclass(frozen=True)
class LearningCurves:
    """Quartiles over the wearers against seconds of motion: worst shoulder axis and elbow [N·m]."""

    t: list[float]
    shoulder: list[list[float | None]]
    elbow: list[list[float | None]]


@dataclass(frozen=True)
class MethodFigures:
    """Results of one method in one setting, over all wearers. Shares lie between 0 and 1; None if undefined."""

    method: str
    level: int
    profile: str
    setting: str
    only: str | None
    without: str | None
    never_relaxed: bool
    world: str
    offline: bool
    wearers: int
    failed: int
    time_to_target_s: MedianFigures
    time_to_coarse_s: MedianFigures
    reached_share: float | None
    reached_coarse_share: float | None
    reached_within_share: dict[str, float | None]
    """Share of runs in which the left over reached its target within these seconds of motion [-]."""

    left_over_Nm: dict[str, PlaceFigures]
    """Left over by seconds of motion."""

    coverage95: Coverage
    coverage95_by_duration: dict[str, Coverage]
    coverage95_torque_by_duration: dict[str, Coverage]
    coverage95_by_parameter: dict[str, Coverage]
    consistent_share: float | None
    outcomes: dict[str, int]
    """Number of wearers by verdict of the stop rule."""

    stop_s: float | None
    told_restless_share: float | None
    rejected_share: float | None
    noise_scale: float | None
    update_us: TimePercentiles
    estimate_us: TimePercentiles
    work_share: float | None
    method_s: float | None
    progress: LearningCurves


@dataclass(frozen=True)
class Winner:
    """Best method that learns while the arm moves, and methods that do not differ significantly from it."""

    method: str | None
    by: str
    median: float | None = None
    tied_with: Sequence[str] = ()
    offline_ahead: Sequence[str] = ()


@dataclass(frozen=True)
class PairedRatio:
    """Ratios of our method's times to a rival's times on the same wearers."""

    setting: str
    level: int
    profile: str
    ours: str
    rival: str
    threshold: str
    ratio_of_medians: float | None
    """Ratio; 0 if only our method reaches the threshold, None if our method or neither method reaches it."""

    ci95: Ends
    wearers: int
    ours_sooner: int
    rival_sooner: int
    same_time: int
    neither_reached: int


@dataclass(frozen=True)
class DisturbancePart:
    """Change of the left over after 120 s by one disturbance [N·m]."""

    row: str
    meaning: str
    kind: str
    method: str
    profile: str
    level: int
    wearers: int
    shoulder_reference_Nm: float | None
    shoulder_Nm: float | None
    shoulder_change_Nm: MedianFigures
    elbow_reference_Nm: float | None
    elbow_Nm: float | None
    elbow_change_Nm: MedianFigures


@dataclass(frozen=True)
class WearerFigures:
    """Short result of one run. The complete run is in the file of runs."""

    setting: str
    method: str
    level: int
    profile: str
    wearer_seed: int
    machine_seed: int
    arm: str
    only: str | None
    without: str | None
    never_relaxed: bool
    world: str
    failed: str | None
    time_to_target_s: float | None
    left_over_Nm: dict[str, Ends]
    """Left over at the worst shoulder axis and the elbow, by seconds of motion."""

    outcome: str
    stop_s: float | None
    method_s: float


@dataclass(frozen=True)
class BenchmarkSummary:
    """Figures of all finished runs."""

    results: list[MethodFigures]
    winner_by_level: dict[str, dict[str, Winner]]
    """Best method by level and kind of drive."""

    paired_ratios: list[PairedRatio]
    break_down: list[DisturbancePart]
    seeds: list[int]
    machine_seeds: list[int]
    wearers: list[WearerFigures]


@dataclass(frozen=True)
class BenchmarkFiles:
    """Paths of page and figure."""

    page: Path
    figure: Path | None
