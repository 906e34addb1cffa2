"""Medians over wearers with paired bootstrap intervals: the same resamples of the same wearers for every method."""

import numpy as np
from jaxtyping import Float, Int

RESAMPLES = 2000
SEED = 20_261_122
"""Fixed: the same wearers are drawn for every method and every repetition of the analysis."""

Values = Float[np.ndarray, " wearer"]
Draws = Int[np.ndarray, "resample wearer"]


def resamples(wearers: int) -> Draws:
    """Which wearers each resample holds."""
    return np.random.default_rng(SEED).integers(0, wearers, (RESAMPLES, wearers))


def median(values: Values) -> float:
    """Infinite where half of the wearers or more never get there."""
    return float(np.median(values)) if len(values) else np.inf


def medians(values: Values) -> Float[np.ndarray, " resample"]:
    """Of every resample; none where there is nobody."""
    if not len(values):
        return np.empty(0)
    return np.median(values[resamples(len(values))], axis=1)


def interval(of_resamples: Float[np.ndarray, " resample"]) -> tuple[float, float]:
    """The 95 % in the middle; by rank, because some may be infinite."""
    ordered = np.sort(of_resamples[~np.isnan(of_resamples)])
    if not len(ordered):
        return np.nan, np.nan
    last = len(ordered) - 1
    return float(ordered[int(0.025 * last)]), float(ordered[int(np.ceil(0.975 * last))])


def ratio(above: Values, below: Values) -> tuple[float, tuple[float, float]]:
    """Ratio of the medians of two methods on the same wearers, with its interval; NaN where neither gets there."""
    with np.errstate(invalid="ignore", divide="ignore"):
        value = np.float64(median(above)) / np.float64(median(below))
        return float(value), interval(medians(above) / medians(below))
