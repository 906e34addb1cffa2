"""Transfer against what the machine left over, and against its friction: points, a falling curve, a slope."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Int
from scipy import optimize

from exograv.session.benchmark_identification.bootstrap import interval, resamples
from exograv.study.statistics.fieller import fieller

from .flight import FAMILIARISED, Flight, compared, familiarised
from .transfer import constant_error_mm, ends_of

BAND_FROM = 5
"""People from which on resamples of them say anything of others."""

GRID = 60
LEAST_NM = 0.01
"""Left over that counts as none, on a logarithmic axis."""

ALIKE = 1e-18
"""Share of their squares below which places do not differ: rounding."""

Xs = Float[np.ndarray, " point"]

LEFT_OVER_ENTERS = (
    "Conditions with motors and without added friction, machine by machine; whatever else differs between them, such "
    "as drives or friction, is in the curve too."
)
FRICTION_ENTERS = (
    "Conditions that are alike but for friction and drives, such as dam, dam@quasi-direct and dam+friction=2; what "
    "friction does to the identification, and so to what is left over, is in the curve too. Where there are several "
    "such kinds, as of dam and of gcm, the slope compares within each; the curve is through all of them."
)


@dataclass(frozen=True)
class Point:
    """One person after one training."""

    person: int
    condition: str
    x: float
    """Left over or friction, of this person's machine [N·m]."""

    trained_mm: float
    familiarised_mm: float


def by_left_over(flights: Sequence[Flight]) -> dict[str, Any]:
    """Over the logarithm of what is left over [N·m]; the slope is for ten times as much."""
    points = [one for one in _points(flights, "left_over_Nm") if "+friction=" not in one.condition]
    scale: Callable[[Xs], Xs] = lambda x: np.log10(np.maximum(x, LEAST_NM))  # noqa: E731
    return _curve(points, scale, "ten times as much left over", LEFT_OVER_ENTERS, lambda _condition: "")


def by_friction(flights: Sequence[Flight]) -> dict[str, Any]:
    """Over friction [N·m]; the slope is for one N·m more."""
    families = dict[str, set[str]]()
    points = _points(flights, "friction_Nm")
    for one in points:
        families.setdefault(family(one.condition), set()).add(one.condition)
    kept = [one for one in points if len(families[family(one.condition)]) > 1]
    return _curve(kept, lambda x: x, "1 N·m more friction", FRICTION_ENTERS, family)


def family(condition: str) -> str:
    """A condition's name without its friction and drives."""
    name = condition.replace("@quasi-direct", "")
    return "+".join(part for part in name.split("+") if not part.startswith("friction="))


def _points(flights: Sequence[Flight], x: str) -> list[Point]:
    before = familiarised(flights)
    found = list[Point]()
    for name, own in compared(flights).items():
        for flight in own:
            value, other = getattr(flight, x), before.get(flight.person)
            if value is None or other is None or flight.condition == FAMILIARISED:
                continue
            errors = constant_error_mm(flight), constant_error_mm(other)
            if np.isfinite(errors).all():
                found.append(Point(flight.person, name, float(value), *errors))
    return found


def _curve(
    points: Sequence[Point], scale: Callable[[Xs], Xs], step: str, enters: str, alike: Callable[[str], str]
) -> dict[str, Any]:
    told: dict[str, Any] = {"which_flights": enters, "points": [], "curve": None, "slope": None}
    people = sorted({one.person for one in points})
    usual = _usual_mm(points)
    whole = fieller(usual, usual) if len(usual) > 1 else None
    if len({one.condition for one in points}) < 2:
        return told | {"sentence": "Fewer than two such conditions were flown: nothing can be read."}
    if usual.mean() == 0.0 or (whole is not None and whole.value is None):
        return told | {"sentence": "The error after familiarisation cannot be told from 0: there is nothing to share."}
    told["points"] = [
        {
            "person": one.person, "condition": one.condition, "x_Nm": one.x,
            "taken_away": (one.familiarised_mm - one.trained_mm) / float(usual.mean()),
        }
        for one in points
    ]  # fmt: skip
    slope = _slope(points, scale, alike)
    told |= {"curve": _monotone(points, people, scale), "slope": slope | {"per": step}}
    return told | {"people": len(people), "sentence": _sentence(slope, step, len(people))}


def _usual_mm(points: Sequence[Point]) -> Float[np.ndarray, " person"]:
    """Error after familiarisation, once a person."""
    by_person = {one.person: one.familiarised_mm for one in points}
    return np.array([by_person[person] for person in sorted(by_person)])


def _slope(points: Sequence[Point], scale: Callable[[Xs], Xs], alike: Callable[[str], str]) -> dict[str, Any]:
    """Each person has parallel straight lines, one through the own conditions of each kind that is `alike`.

    Their mean slope, over the usual error. What two kinds differ by is none of the slope.
    """
    by_person = dict[int, list[Point]]()
    for one in points:
        by_person.setdefault(one.person, []).append(one)
    slopes, usual = list[float](), list[float]()
    for own in by_person.values():
        _, kind = np.unique([alike(one.condition) for one in own], return_inverse=True)
        x = scale(np.array([one.x for one in own]))
        off = x - (np.bincount(kind, x) / np.bincount(kind))[kind]
        if off @ off > ALIKE * (1.0 + x @ x):
            away = np.array([one.familiarised_mm - one.trained_mm for one in own])
            slopes.append(float(off @ away / (off @ off)))
            usual.append(own[0].familiarised_mm)
    found = fieller(np.array(slopes), np.array(usual))
    return {"value": found.value, "ci95": ends_of(found.interval), "reason": found.reason or None}


def _monotone(points: Sequence[Point], people: Sequence[int], scale: Callable[[Xs], Xs]) -> dict[str, Any]:
    """Never rising, of no given shape; the band by drawing people, all their points with them."""
    x = np.array([one.x for one in points])
    ends = scale(np.array([x.min(), x.max()]))
    grid = np.linspace(ends[0], ends[1], GRID)
    of = {person: [one for one in points if one.person == person] for person in people}
    middle = _falling(points, scale, grid)
    at = 10.0**grid if abs(float(scale(np.array([10.0]))[0]) - 1.0) < 1e-9 else grid
    told: dict[str, Any] = {"x_Nm": at.tolist(), "transfer": middle.tolist(), "low": None, "high": None}
    if len(people) < BAND_FROM:
        return told | {"reason": f"no band: fewer than {BAND_FROM} people"}
    drawn = np.array([_drawn(of, people, row, scale, grid) for row in resamples(len(people)).tolist()])
    bands = [interval(column) for column in drawn.T]
    return told | {"low": [low for low, _ in bands], "high": [high for _, high in bands], "reason": None}


def _drawn(
    of: Mapping[int, Sequence[Point]], people: Sequence[int], row: Sequence[int], scale: Callable[[Xs], Xs], grid: Xs
) -> Xs:
    return _falling([one for k in row for one in of[people[k]]], scale, grid, [of[people[k]][0] for k in row])


def _falling(points: Sequence[Point], scale: Callable[[Xs], Xs], grid: Xs, people: Sequence[Point] | None = None) -> Xs:
    """Of all curves that never rise the nearest to the conditions' means, at the grid; `people`: a point of each."""
    usual = _usual_mm(points) if people is None else np.array([one.familiarised_mm for one in people])
    x = scale(np.array([one.x for one in points]))
    y = np.array([one.familiarised_mm - one.trained_mm for one in points])
    # A condition's machines are much alike: by their own places the curve would follow the people's noise.
    _, where, counts = np.unique([one.condition for one in points], return_inverse=True, return_counts=True)
    at, means = np.bincount(where, x) / counts, np.bincount(where, y) / counts
    # Conditions of one place are one.
    at, same, weights = _merged(at, counts.astype(float))
    means = np.bincount(same, means * counts) / weights
    fitted = optimize.isotonic_regression(means, weights=weights, increasing=False).x
    return np.interp(grid, at, fitted) / usual.mean()


def _merged(
    at: Float[np.ndarray, " condition"], counts: Float[np.ndarray, " condition"]
) -> tuple[Float[np.ndarray, " place"], Int[np.ndarray, " condition"], Float[np.ndarray, " place"]]:
    """Different places in their order, which of them each condition has, and how many points there are."""
    places, same = np.unique(at, return_inverse=True)
    return places, same, np.bincount(same, counts)


def _sentence(slope: Mapping[str, Any], step: str, people: int) -> str:
    who = "one person" if people == 1 else f"{people} people"
    if slope["value"] is None:
        return f"No slope can be told: {slope['reason']}."
    said = f"With {step} transfer changes by {slope['value']:+.2f}".replace("-", "−")
    if slope["ci95"] is None:
        return f"{said} ({who}; no interval: {slope['reason']})."
    low, high = (f"{end:+.2f}".replace("-", "−") for end in slope["ci95"])
    said = f"{said} (95 % interval {low} to {high}, {who})"
    if slope["ci95"][0] <= 0.0 <= slope["ci95"][1]:
        return f"{said}: that it changes at all is not shown."
    return f"{said}: it {'falls' if slope['value'] < 0 else 'rises'}."
