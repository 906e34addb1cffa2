"""What a run comes to: windows, touches by their fate, and how far off they were."""

import numpy as np

from exograv.model.rig_settings import Settings

from .state import RunState


class Quartiles(Settings):
    """Of the accepted touches."""

    median: float
    q1: float
    q3: float


class Totals(Settings):
    """The summary of a run."""

    windows: int
    """Run to their end."""

    touches: int
    accepted: int
    rejected: dict[str, int]
    """By the word of `pointing.Reason`."""

    deviation_px: Quartiles | None
    deviation_mm: Quartiles | None
    """None without touches, or on a screen that is not calibrated."""

    touches_per_window: float | None
    """Median of accepted ones over the complete windows."""

    def figures(self) -> dict[str, object]:
        """As `--json` writes it."""
        nothing = dict.fromkeys(Quartiles.model_fields)
        return {
            **self.model_dump(),
            "deviation_px": nothing if self.deviation_px is None else self.deviation_px.model_dump(),
            "deviation_mm": nothing if self.deviation_mm is None else self.deviation_mm.model_dump(),
            "touches_per_window": {"median": self.touches_per_window},
        }


def totals(state: RunState) -> Totals:
    """Of all touches so far."""
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
    """None without values."""
    if not values:
        return None
    q1, median, q3 = (float(value) for value in np.quantile(values, [0.25, 0.5, 0.75]))
    return Quartiles(median=median, q1=q1, q3=q3)
