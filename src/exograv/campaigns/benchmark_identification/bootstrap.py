"""Medians over wearers with paired bootstrap intervals: all methods use the same resamples of the same wearers."""

import numpy as np
from jaxtyping import Float, Int

RESAMPLES = 2000
SEED = 20_261_122
"""Fixed seed: the same wearers are drawn for every method and for every repetition of the analysis."""

Values = Float[np.ndarray, " wearer"]
Draws = Int[np.ndarray, "resample wearer"]


def resamples(wearers: int) -> Draws:
    """Draw the wearers of each resample."""
    return np.random.default_rng(SEED).integers(0, wearers, (RESAMPLES, wearers))


def median(values: Values) -> float:
    """Median over wearers; infinite if half of the wearers or more never reach the target."""
    return float(np.median(values)) if len(values) else np.inf


def medians(values: Values) -> Float[np.ndarray, " resample"]:
    """Median of every resample; empty without wearers."""
    if not len(values):
        return np.empty(0)
    return np.median(values[resamples(len(values))], axis=1)


def interval(of_resamples: Float[np.ndarray, " resample"]) -> tuple[float, float]:
    """Central 95 % interval, computed by rank because some values may be infinite."""
    ordered = np.sort(of_resamples[~np.isnan(of_resamples)])
    if not len(ordered):
        return np.nan, np.nan
    last = len(ordered) - 1
    return float(ordered[int(0.025 * last)]), float(ordered[int(np.ceil(0.975 * last))])


def ratio(above: Values, below: Values) -> tuple[float, tuple[float, float]]:
    """Ratio of the medians of two methods on the same wearers, with its interval; NaN if neither reaches the target."""
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.float64(median(above)) / np.float64(median(below))
        return float(value), interval(medians(above) / medians(below))
