"""Summary of a run: windows, touches by reason of rejection, and deviations."""

from dataclasses import dataclass

import numpy as np

from exograv.model.rig_settings import Settings

from .state import RunState


class Quartiles(Settings):
    """Quartiles over the accepted touches."""

    median: float
    q1: float
    q3: float


class Totals(Settings):
    """Summary of a run."""

    windows: int
    """Number of windows that were run to their end."""

    touches: int
    """Number of touches, without those that the page sent again."""

    accepted: int
    rejected: dict[str, int]
    """Rejected touches by the value of `pointing.RejectionReason`."""

    deviation_px: Quartiles | None
    deviation_mm: Quartiles | None
    """Deviation in mm; None without touches, or on a screen without calibration."""

    touches_per_window: float | None
    """Median number of accepted touches over the complete windows; None without a complete window."""

    def figures(self) -> "TotalsFigures":
        """Figures for `--json` and recordings."""
        return TotalsFigures(
            self.windows,
            self.touches,
            self.accepted,
            self.rejected,
            self.deviation_px or NO_TOUCHES,
            self.deviation_mm or NO_TOUCHES,
            MedianTouches(self.touches_per_window),
        )


@dataclass(frozen=True)
class NoQuartiles:
    """Placeholder for quartiles when there is no accepted touch."""

    median: None = None
    q1: None = None
    q3: None = None


NO_TOUCHES = NoQuartiles()


@dataclass(frozen=True)
class MedianTouches:
    """Median number of accepted touches in a complete window."""

    median: float | None


@dataclass(frozen=True)
class TotalsFigures:
    """Summary of a run for `--json`."""

    windows: int
    touches: int
    accepted: int
    rejected: dict[str, int]
    deviation_px: Quartiles | NoQuartiles
    deviation_mm: Quartiles | NoQuartiles
    touches_per_window: MedianTouches


def totals(state: RunState) -> Totals:
    """Return the summary of all touches up to now."""
    px = [value for window in state.windows for value in window.deviations_px]
    mm = [value for window in state.windows for value in window.deviations_mm if value is not None]
    in_complete = [len(window.deviations_px) for window in state.windows if window.is_complete]
    return Totals(
        windows=len(state.complete),
        touches=state.touches,
        accepted=len(px),
        rejected={reason.value: count for reason, count in state.rejected.items()},
        deviation_px=quartiles(px),
        deviation_mm=quartiles(mm),
        touches_per_window=float(np.median(in_complete)) if in_complete else None,
    )


def quartiles(values: list[float]) -> Quartiles | None:
    """Quartiles of the values; None without values."""
    if not values:
        return None
    q1, median, q3 = (float(value) for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return Quartiles(median=median, q1=q1, q3=q3)
