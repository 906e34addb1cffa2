"""Power and precision over the number of people, and the effect of more windows, touches and flights."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from math import ceil, exp

import numpy as np

from exograv.results import MERGED, OPTIONAL
from exograv.study.statistics.relabelling import generic_smallest_p

from .assumptions import PlannedStudy, TruthAssumptions, sure_worlds
from .options import N_MIN, CurveOptions, Price
from .pilot import PilotVariance
from .simulate import Shares, people, shares

TARGETS = (0.8, 0.9)
ENOUGH = 0.99
"""Power at which the curve ends, once it has `N_SHOWN` points."""

N_SHOWN = 12
WINDOWS, TOUCHES, FLIGHTS = (1, 2, 5, 10, 20, 31), (1, 2, 4, 8, 16), (1, 2, 3)
"""Values in the table of the plan's alternatives."""

Progress = Callable[[str, float], None]


@dataclass(frozen=True)
class CurveRow:
    """Row of the curve for one number of people per group."""

    n: int
    power: float
    """Share of studies in which the exact test finds the difference."""

    power_interval: tuple[float, float]
    welch_power: float
    p_min: float
    width_factor: float
    """Factor by which the ends of the 95 % interval lie above and below the ratio."""

    seats: int
    flights: int | None = field(default=None, metadata=OPTIONAL)
    cost: float | None = field(default=None, metadata=OPTIONAL)
    assurance: float | None = field(default=None, metadata=OPTIONAL)
    """Power averaged over the uncertainty of the pilot study's results."""


@dataclass(frozen=True)
class OtherPlan:
    """Power of a plan with another number of windows, touches or flights."""

    windows: int | None = field(default=None, metadata=OPTIONAL)
    touches: int | None = field(default=None, metadata=OPTIONAL)
    flights: int | None = field(default=None, metadata=OPTIONAL)
    power: float = 0.0
    sd_of_medians: float = 0.0


@dataclass(frozen=True)
class WhatMatters:
    """Other plans at `n` people per group."""

    n: int
    rows: tuple[OtherPlan, ...]


@dataclass(frozen=True)
class Assumptions:
    """Plan, and the ratio that corresponds to its difference."""

    plan: PlannedStudy = field(metadata=MERGED)
    ratio: float


@dataclass(frozen=True)
class PowerResult:
    """Result of `exograv study power`."""

    n_per_group: dict[str, int | None]
    """Required number of people per group, by power in per cent."""

    curve: tuple[CurveRow, ...]
    n_per_group_assurance: dict[str, int | None] | None
    matters: WhatMatters
    assumptions: Assumptions
    seed: int
    studies: int
    sentences: tuple[str, ...] = ()


def power_study(
    plan: PlannedStudy,
    price: Price,
    asked: CurveOptions,
    progress: Progress,
    pilot: PilotVariance | None = None,
    is_stated: bool = True,
) -> PowerResult:
    """Compute how many people a study needs.

    Args:
        plan: The planned study.
        price: Price of seats on the aircraft.
        asked: Resolution of the curve.
        progress: Takes a sentence and the completed share.
        pilot: Source of the plan's numbers; its uncertainty enters as assurance.
        is_stated: True if the difference is one that is worth finding, false if it is the pilot's own.
    """
    drawn = None
    if pilot is not None:
        stated = plan.difference if is_stated else None
        drawn = pilot.worlds(asked.studies, stated, np.random.default_rng([asked.seed, 1]))
    curve = tuple(_curve(plan, price, asked, drawn, progress))
    needed = {f"{100 * target:.0f}": _first(curve, "power", target) for target in TARGETS}
    assured = {f"{100 * target:.0f}": _first(curve, "assurance", target) for target in TARGETS if drawn is not None}
    at = needed["80"] or curve[-1].n
    progress("Effect of more windows, touches and flights", 0.95)
    result = PowerResult(
        needed,
        curve,
        assured or None,
        WhatMatters(at, tuple(_what_matters(plan, asked, at))),
        Assumptions(plan, exp(-abs(plan.difference))),
        asked.seed,
        asked.studies,
    )
    told = list(sentences(result, plan))
    if pilot is not None and not is_stated:
        told.append(
            "The difference is the pilot's own. Such a difference is usually too large, and may not exist at all: more "
            "people cannot correct that. Give a difference that is worth finding with --difference."
        )
    return replace(result, sentences=tuple(told))


def _curve(
    plan: PlannedStudy, price: Price, asked: CurveOptions, drawn: TruthAssumptions | None, progress: Progress
) -> Iterator[CurveRow]:
    sure = sure_worlds(plan, asked.studies)
    for n in range(N_MIN, asked.n_max + 1):
        progress(f"{n} against {n} people", 0.9 * (n - N_MIN) / (asked.n_max - N_MIN + 1))
        found = shares(plan, sure, n, asked.seed)
        assurance = None if drawn is None else shares(plan, drawn, n, asked.seed).power
        yield _row(n, found, plan, price, assurance)
        if n >= N_SHOWN and min(found.power, 1.0 if assurance is None else assurance) >= ENOUGH:
            return


def _row(n: int, found: Shares, plan: PlannedStudy, price: Price, assurance: float | None) -> CurveRow:
    return CurveRow(
        n,
        found.power,
        found.power_interval,
        found.welch_power,
        generic_smallest_p(n, n),
        found.width_factor,
        *seats(n, plan, price),
        assurance,
    )


def seats(n: int, plan: PlannedStudy, price: Price) -> tuple[int, int | None, float | None]:
    """Return seats for n people per group, flights that carry them, and their cost, as far as the price states them."""
    count, carried, cost = 2 * n * plan.flights, price.seats_per_flight, price.seat_cost
    flights = None if carried is None else max(plan.flights, ceil(count / carried))
    return count, flights, None if cost is None else cost * count


def _first(curve: Sequence[CurveRow], key: str, target: float) -> int | None:
    return next((row.n for row in curve if getattr(row, key) >= target), None)


def _what_matters(plan: PlannedStudy, asked: CurveOptions, n: int) -> Iterator[OtherPlan]:
    """Yield power and the spread of a person's median at n people per group, for other windows, touches and flights."""
    for name, values in (("windows", WINDOWS), ("touches", TOUCHES), ("flights", FLIGHTS)):
        for value in sorted({*values, getattr(plan, name)}):
            other = replace(plan, **{name: value})
            worlds = sure_worlds(other, asked.studies)
            rng = np.random.default_rng([asked.seed, 2])
            alone = people(replace(other, difference=0.0), sure_worlds(replace(other, difference=0.0), 2000), 2, rng)
            power = shares(other, worlds, n, asked.seed).power
            yield OtherPlan(**{name: value}, power=power, sd_of_medians=float(alone.std()))


def sentences(result: PowerResult, plan: PlannedStudy) -> Iterator[str]:
    """Yield sentences that state the figures."""
    curve, needed = result.curve, result.n_per_group
    ratio = result.assumptions.ratio
    for target, n in needed.items():
        yield (
            f"To find a ratio of {ratio:.2g} in {target} % of studies, {n} people per group are needed."
            if n is not None
            else f"With {curve[-1].n} people per group or fewer, a ratio of {ratio:.2g} is not found in {target} % of "
            "studies."
        )
    unable = [row.n for row in curve if row.p_min > plan.alpha + 1e-12]
    if unable:
        yield (
            f"With {unable[-1]} against {unable[-1]} people or fewer the exact test cannot reach {plan.alpha:g}: its "
            "power is 0 for any effect."
        )
    rows = [row for row in result.matters.rows if row.windows in (1, 5, plan.windows)]
    powers = ", ".join(f"{row.power:.2f} with {row.windows}" for row in rows)
    yield (
        f"At {result.matters.n} people per group the power by windows of each person is {powers}. The differences "
        "between people limit it."
    )
    if (assured := result.n_per_group_assurance) is not None:
        last = curve[-1]
        yield "Averaged over the uncertainty of the pilot (assurance), " + (
            f"a power of 80 % needs {assured['80']} people per group."
            if assured["80"] is not None
            else f"{last.n} people per group find the difference in {100 * (last.assurance or 0.0):.0f} % of studies."
        )
    if plan.flight_sd == 0.0:
        yield "Each person is assumed to be the same in every flight (--flight-sd 0): more flights add only touches."
