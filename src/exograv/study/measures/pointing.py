"""Pointing measures of a set of touches: error of the mean, scatter about it, direction and pace."""

import numpy as np
import pandas as pd
from jaxtyping import Float

from exograv.study.dataset.tables import Tables

from .selecting import column, columns, middle, rows

# 95 % quantile of the χ² distribution with two degrees of freedom: −2·log(1 − 0.95).
ELLIPSE_95 = 5.991464547107979
MIN_SCATTER = 3
"""Least number of touches for a scatter."""

ATTEMPT = ["participant", "protocol", "session", "window", "attempt"]

Points = Float[np.ndarray, "touch 2"]


def counted(tables: Tables) -> pd.DataFrame:
    """Return the accepted touches of complete attempts; of a repeated window, those of the last complete attempt.

    Each row also has the window's `opened_s` and `closed_s`.
    """
    windows = rows(tables.windows, tables.windows["is_complete"]).sort_values(by=ATTEMPT)
    windows = windows.drop_duplicates(ATTEMPT[:-1], keep="last")
    touches = rows(tables.touches, tables.touches["is_accepted"])
    kept = touches.merge(columns(windows, [*ATTEMPT, "opened_s", "closed_s"]), on=ATTEMPT)
    return kept.sort_values([*ATTEMPT, "t_s"], ignore_index=True)


def deviations(touches: pd.DataFrame, unit: str) -> Points:
    """Deviation right and up from the target's centre, for touches that have it in this unit."""
    both = columns(touches, [f"deviation_x_{unit}", f"deviation_y_{unit}"]).to_numpy(float)
    return both[np.isfinite(both).all(1)] * (1.0, -1.0)


def directions_deg(points: Points) -> Float[np.ndarray, " touch"]:
    """Direction of each deviation [°], −180…180 from right, upwards positive."""
    return np.rad2deg(np.arctan2(points[:, 1], points[:, 0]))


def mean_direction(directions_deg: Float[np.ndarray, " touch"]) -> tuple[float, float]:
    """Circular mean [°] and mean resultant length [-]."""
    if not len(directions_deg):
        return np.nan, np.nan
    mean = np.exp(1j * np.deg2rad(directions_deg)).mean()
    return float(np.rad2deg(np.angle(mean))), float(abs(mean))


def ellipse(points: Points) -> tuple[float, float, float]:
    """Half axes of the 95 % ellipse of the scatter, in the unit of the points, and angle of the major axis [°]."""
    if len(points) < MIN_SCATTER:
        return np.nan, np.nan, np.nan
    values, vectors = np.linalg.eigh(np.cov(points.T))
    minor, major = np.sqrt(ELLIPSE_95 * np.clip(values, 0.0, None))
    angle = np.rad2deg(np.arctan2(vectors[1, 1], vectors[0, 1])) % 180.0
    return float(major), float(minor), float(angle)


def scatter_measures(touches: pd.DataFrame, unit: str) -> dict[str, float]:
    """Compute constant error, variable error and ellipse of a session's touches, by name of the measure."""
    points = deviations(touches, unit)
    lengths = np.linalg.norm(points, axis=1)
    n = len(points)
    mean = points.mean(0) if n else np.full(2, np.nan)
    spread = points.std(0, ddof=1) if n >= MIN_SCATTER else np.full(2, np.nan)
    major, minor, _ = ellipse(points)
    quartiles = np.quantile(lengths, (0.25, 0.5, 0.75)) if n else np.full(3, np.nan)
    values = {
        "median_deviation": quartiles[1],
        "iqr_deviation": quartiles[2] - quartiles[0],
        "constant_error_right": mean[0],
        "constant_error_up": mean[1],
        "constant_error": np.hypot(*mean),
        "variable_error": np.hypot(*spread),
        "variable_error_right": spread[0],
        "variable_error_up": spread[1],
        "ellipse_major": major,
        "ellipse_minor": minor,
    }
    return {f"{name}_{unit}": float(value) for name, value in values.items()}


def pace_share(touches: pd.DataFrame) -> float:
    """Share of the intervals that were neither too short nor too long; NaN if the pace was not judged."""
    judged = column(touches, "pace").dropna().tolist()
    return judged.count("right") / len(judged) if judged else np.nan


def session_measures(touches: pd.DataFrame, windows: int) -> dict[str, float]:
    """Compute the measures of a session from touches and the number of complete windows. Names contain the units."""
    points = deviations(touches, "px")
    direction, strength = mean_direction(directions_deg(points))
    return {
        **scatter_measures(touches, "px"),
        **scatter_measures(touches, "mm"),
        "ellipse_angle_deg": ellipse(points)[2],
        "mean_direction_deg": direction,
        "direction_strength": strength,
        "touches_per_window": len(touches) / windows if windows else np.nan,
        "median_interval_s": middle(touches, "interval_s"),
        "share_in_pace": pace_share(touches),
    }


def window_measures(touches: pd.DataFrame) -> dict[str, float]:
    """Compute the measures of one window."""
    return {
        "median_deviation_px": middle(touches, "deviation_px"),
        "median_deviation_mm": middle(touches, "deviation_mm"),
        "touches": float(len(touches)),
        "share_in_pace": pace_share(touches),
    }
