"""Power and precision over the number of people, and what windows, touches and flights add."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import ceil, exp
from typing import Any

import numpy as np

from exograv.study.statistics.relabelling import generic_smallest_p

from .assumptions import PlannedStudy, Worlds, sure_worlds
from .options import N_MIN, CurveOptions, Price
from .pilot import PilotVariance
from .simulate import Shares, people, shares

TARGETS = (0.8, 0.9)
ENOUGH = 0.99
"""Power from which on the curve is of no interest, once it has `N_SHOWN` points."""

N_SHOWN = 12
WINDOWS, TOUCHES, FLIGHTS = (1, 2, 5, 10, 20, 31), (1, 2, 4, 8, 16), (1, 2, 3)
"""Rows of the table of what matters."""

Progress = Callable[[str, float], None]


def power_study(
    plan: PlannedStudy,
    price: Price,
    asked: CurveOptions,
    progress: Progress,
    pilot: PilotVariance | None = None,
    is_stated: bool = True,
) -> dict[str, Any]:
    """Everything that `exograv study power --json` writes.

    Args:
        plan: The study.
        price: Of seats.
        asked: How.
        progress: Takes a sentence and the share done.
        pilot: Where the plan's numbers come from; its uncertainty is carried along as assurance.
        is_stated: The difference is what somebody wants to find, not what the pilot had.
    """
    drawn = None
    if pilot is not None:
        stated = plan.difference if is_stated else None
        drawn = pilot.worlds(asked.studies, stated, np.random.default_rng([asked.seed, 1]))
    curve = list(_curve(plan, price, asked, drawn, progress))
    needed = {f"{100 * target:.0f}": _first(curve, "power", target) for target in TARGETS}
    at = needed["80"] or curve[-1]["n"]
    progress("What windows, touches and flights add", 0.95)
    result = {
        "n_per_group": needed,
        "curve": curve,
        "n_per_group_assurance": None
        if drawn is None
        else {f"{100 * target:.0f}": _first(curve, "assurance", target) for target in TARGETS},
        "matters": {"n": at, "rows": list(_what_matters(plan, asked, at))},
        "assumptions": {name: getattr(plan, name) for name in plan.__dataclass_fields__}
        | {"ratio": exp(-abs(plan.difference))},
        "seed": asked.seed,
        "studies": asked.studies,
    }
    told = list(sentences(result, plan))
    if pilot is not None and not is_stated:
        told.append(
            "The difference is the pilot's own, as a rule too large, and may not be there at all: no number of people "
            "makes up for that. State by --difference what is worth finding."
        )
    return result | {"sentences": told}


def _curve(
    plan: PlannedStudy, price: Price, asked: CurveOptions, drawn: Worlds | None, progress: Progress
) -> Iterator[dict[str, Any]]:
    sure = sure_worlds(plan, asked.studies)
    for n in range(N_MIN, asked.n_max + 1):
        progress(f"{n} against {n} people", 0.9 * (n - N_MIN) / (asked.n_max - N_MIN + 1))
        found = shares(plan, sure, n, asked.seed)
        row = _row(n, found) | seats(n, plan, price)
        if drawn is not None:
            row["assurance"] = shares(plan, drawn, n, asked.seed).power
        yield row
        if n >= N_SHOWN and min(found.power, row.get("assurance", 1.0)) >= ENOUGH:
            return


def _row(n: int, found: Shares) -> dict[str, Any]:
    return {
        "n": n,
        "power": found.power,
        "power_interval": list(found.power_interval),
        "welch_power": found.welch_power,
        "p_min": generic_smallest_p(n, n),
        "width_factor": found.width_factor,
    }


def seats(n: int, plan: PlannedStudy, price: Price) -> dict[str, Any]:
    """Of n people a group: seats, flights that carry them, cost; only what the price tells."""
    count = 2 * n * plan.flights
    row: dict[str, Any] = {"seats": count}
    if price.seats_per_flight is not None:
        row["flights"] = max(plan.flights, ceil(count / price.seats_per_flight))
    if price.seat_cost is not None:
        row["cost"] = price.seat_cost * count
    return row


def _first(curve: list[dict[str, Any]], key: str, target: float) -> int | None:
    return next((row["n"] for row in curve if row[key] >= target), None)


def _what_matters(plan: PlannedStudy, asked: CurveOptions, n: int) -> Iterator[dict[str, Any]]:
    """Power at n people a group with other numbers of windows, touches, flights; the spread of a person's median."""
    for name, values in (("windows", WINDOWS), ("touches", TOUCHES), ("flights", FLIGHTS)):
        for value in sorted({*values, getattr(plan, name)}):
            other = replace(plan, **{name: value})
            worlds = sure_worlds(other, asked.studies)
            rng = np.random.default_rng([asked.seed, 2])
            alone = people(replace(other, difference=0.0), sure_worlds(replace(other, difference=0.0), 2000), 2, rng)
            power = shares(other, worlds, n, asked.seed).power
            yield {name: value, "power": power, "sd_of_medians": float(alone.std())}


def sentences(result: dict[str, Any], plan: PlannedStudy) -> Iterator[str]:
    """What the figures say."""
    curve, needed = result["curve"], result["n_per_group"]
    ratio = result["assumptions"]["ratio"]
    for target, n in needed.items():
        yield (
            f"To find a ratio of {ratio:.2g} in {target} % of studies it takes {n} people a group."
            if n is not None
            else f"Up to {curve[-1]['n']} people a group a ratio of {ratio:.2g} is not found in {target} % of studies."
        )
    unable = [row["n"] for row in curve if row["p_min"] > plan.alpha + 1e-12]
    if unable:
        yield (
            f"With {unable[-1]} against {unable[-1]} people or fewer the exact test cannot reach {plan.alpha:g}: its "
            "power is 0, whatever the effect."
        )
    rows = [row for row in result["matters"]["rows"] if "windows" in row and row["windows"] in (1, 5, plan.windows)]
    powers = ", ".join(f"{row['power']:.2f} with {row['windows']}" for row in rows)
    yield (
        f"At {result['matters']['n']} people a group the power by windows of each person is {powers}: it cannot pass "
        "what people's own differences leave."
    )
    if (assured := result["n_per_group_assurance"]) is not None:
        last = curve[-1]
        yield "Over all that the pilot leaves open (assurance), " + (
            f"it takes {assured['80']} people a group for 80 %."
            if assured["80"] is not None
            else f"{last['n']} people a group find it in {100 * last['assurance']:.0f} % of studies."
        )
    if plan.flight_sd == 0.0:
        yield "A person is taken to be the same in every flight (--flight-sd 0): then more flights add only touches."
