"""Simulation of thousands of studies at once: one number per person, and the report's own test on each study."""

from dataclasses import dataclass
from math import sqrt

import numpy as np
from jaxtyping import Float
from scipy import special, stats

from exograv.study.statistics.normal import welch_width
from exograv.study.statistics.relabelling import generic_smallest_p, relabellings, two_sided

from .assumptions import PlannedStudy, TruthAssumptions

COUNTED_MAX = 13_000
"""Number of relabellings up to which all are enumerated: 8 against 8 people have 12 870.

From 9 people on, `DRAWN` relabellings are drawn. The test stays exact and loses half a percent of power.
"""

DRAWN = 999


def people(
    plan: PlannedStudy, worlds: TruthAssumptions, n: int, rng: np.random.Generator
) -> Float[np.ndarray, "study person"]:
    """Median log deviation of each person; the first n are the first group.

    Touches are not drawn one by one. The middle one of N ordered normal touches follows a beta distribution, mapped
    back.
    Windows and flights shift the touches together; the median moves with their mean.
    """
    shape = (len(worlds.difference), 2 * n)
    together_sd = sqrt(plan.flight_sd**2 / plan.flights + plan.window_sd**2 / (plan.flights * plan.windows))
    spread = np.sqrt(worlds.person_sd**2 + together_sd**2)
    values = spread[:, None] * rng.standard_normal(shape)
    values += worlds.touch_sd[:, None] * touch_medians(plan.flights * plan.windows * plan.touches, shape, rng)
    values[:, :n] += worlds.difference[:, None]
    return values


def touch_medians(touches: int, shape: tuple[int, int], rng: np.random.Generator) -> Float[np.ndarray, "study person"]:
    """Draw medians of `touches` standard normal touches, from the distribution of the ordered ones."""
    half = (touches + 1) // 2
    lower = rng.beta(half, touches + 1 - half, shape)
    if touches % 2:
        return special.ndtri(lower)
    # The next order statistic is the smallest of `half` others, which lie anywhere above.
    upper = lower + (1.0 - lower) * -np.expm1(np.log(rng.uniform(size=shape)) / half)
    return (special.ndtri(lower) + special.ndtri(upper)) / 2.0


@dataclass(frozen=True)
class Shares:
    """Shares of simulated studies with n people per group."""

    power: float
    """Share in which the exact test's p is at most alpha."""

    power_interval: tuple[float, float]
    """95 % interval of `power`, for the number of simulated studies."""

    welch_power: float
    width_factor: float
    """Median over the studies; the ratio's 95 % interval is the estimate divided and multiplied by this factor."""


def shares(plan: PlannedStudy, worlds: TruthAssumptions, n: int, seed: int) -> Shares:
    """Simulate studies. The same seed gives the same studies, independent of earlier calls."""
    rng = np.random.default_rng([seed, n])
    values = people(plan, worlds, n, rng)
    width, welch_found = welch_width(values[:, :n], values[:, n:], plan.alpha)
    found = 0
    # Where no relabelling can reach alpha the power is exactly 0, so there is nothing to simulate.
    if generic_smallest_p(n, n) <= plan.alpha + 1e-12:
        ways = relabellings(n, n, rng, COUNTED_MAX, DRAWN)
        found = int((two_sided(values, ways) <= plan.alpha + 1e-12).sum())
    interval = stats.binomtest(found, len(values)).proportion_ci(0.95, "wilson")
    is_possible = found > 0
    return Shares(
        power=found / len(values),
        power_interval=(float(interval.low), float(interval.high)) if is_possible else (0.0, 0.0),
        welch_power=float(welch_found.mean()),
        width_factor=float(np.exp(np.median(width))),
    )
