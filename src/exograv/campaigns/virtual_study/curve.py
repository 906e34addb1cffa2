"""Transfer against left over and against friction: points, a monotone curve, a slope."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from jaxtyping import Float, Int
from scipy import optimize

from exograv.campaigns.benchmark_identification.bootstrap import interval, resamples
from exograv.results import OPTIONAL
from exograv.study.statistics.fieller import fieller

from .conditions import Condition, condition_of
from .flight import FAMILIARISED, VirtualFlight, compared, familiarised
from .transfer import constant_error_mm, ends_of

BAND_FROM = 5
"""Smallest number of people for a bootstrap band."""

GRID = 60
LEAST_NM = 0.01
"""Smallest left over on the logarithmic axis [N·m]; smaller values are drawn at this value."""

ALIKE = 1e-18
"""Relative squared difference below which places count as equal [-]: rounding."""

Xs = Float[np.ndarray, " point"]

ENTERS = (
    "The curve and its slope use conditions that differ only by {what}, such as {such}: {through}. All other "
    "conditions are shown as separate points, because they differ by more."
)

Kind = tuple[str, str, int]
"""Training, drives and sessions before the flight, the same for all conditions of one curve."""


@dataclass(frozen=True)
class CurvePoint:
    """Point of one person after one training."""

    person: int
    condition: str
    kind: Kind
    x: float
    """Left over or friction of this person's machine [N·m]."""

    trained_mm: float
    familiarised_mm: float


@dataclass(frozen=True)
class Axis:
    """Horizontal axis of a transfer curve."""

    what: str
    such: str
    """Example conditions that differ only by this axis."""

    step: str
    """Step of the axis to which the slope refers."""

    scale: Callable[[Xs], Xs]


LEFT_OVER = Axis(
    "what is left on purpose", "ideal, ideal+left=0.1 and ideal+left=0.4", "ten times as much left over",
    lambda x: np.log10(np.maximum(x, LEAST_NM)),
)  # fmt: skip
FRICTION = Axis("friction", "ideal, ideal+friction=2 and ideal+friction=4", "1 N·m more friction", lambda x: x)


@dataclass(frozen=True)
class DrawnPoint:
    """Point of one person after one training, as in the figure."""

    person: int
    condition: str
    x_Nm: float
    is_on_curve: bool
    taken_away: float


@dataclass(frozen=True)
class FallingCurve:
    """Curve that never rises, and its band."""

    x_Nm: list[float]
    transfer: list[float]
    low: list[float] | None
    high: list[float] | None
    reason: str | None
    """Reason why the band is missing; None if there is a band."""


@dataclass(frozen=True)
class Slope:
    """Mean slope of the straight lines of all people."""

    value: float | None
    ci95: list[float] | None
    reason: str | None
    per: str


@dataclass(frozen=True)
class TransferCurve:
    """Transfer against left over, or against friction."""

    which_flights: str
    through: list[str]
    """Conditions of the curve."""

    points: list[DrawnPoint] = field(default_factory=list)
    curve: FallingCurve | None = None
    slope: Slope | None = None
    people: int | None = field(default=None, metadata=OPTIONAL)
    sentence: str = ""


def by_left_over(flights: Sequence[VirtualFlight]) -> TransferCurve:
    """Transfer against the logarithm of left over [N·m], at the machine's own friction; slope per factor of ten."""
    return _curve(_points(flights, "left_over_Nm", lambda one: one.friction == 1.0), LEFT_OVER)


def by_friction(flights: Sequence[VirtualFlight]) -> TransferCurve:
    """Return transfer against friction [N·m], for conditions that carry the whole weight; the slope is per N·m."""
    return _curve(_points(flights, "friction_Nm", lambda one: one.left == 0.0), FRICTION)


def through(points: Sequence[CurvePoint]) -> list[CurvePoint]:
    """Select the points of the kind with the most conditions; the first of several, empty if no kind has two."""
    conditions = dict[Kind, set[str]]()
    for one in points:
        conditions.setdefault(one.kind, set()).add(one.condition)
    most = max(conditions, key=lambda kind: len(conditions[kind]), default=None)
    return [] if most is None or len(conditions[most]) < 2 else [one for one in points if one.kind == most]


def _points(flights: Sequence[VirtualFlight], x: str, enters: Callable[[Condition], bool]) -> list[CurvePoint]:
    before = familiarised(flights)
    found = list[CurvePoint]()
    for name, own in compared(flights).items():
        for flight in own:
            value, other = getattr(flight, x), before.get(flight.person)
            if value is None or other is None or flight.condition == FAMILIARISED:
                continue
            condition = condition_of(flight.condition)
            errors = constant_error_mm(flight), constant_error_mm(other)
            if enters(condition) and np.isfinite(errors).all():
                kind = condition.training, condition.drives, flight.sessions
                found.append(CurvePoint(flight.person, name, kind, float(value), *errors))
    return found


def _curve(points: Sequence[CurvePoint], axis: Axis) -> TransferCurve:
    own = through(points)
    names = list(dict.fromkeys(one.condition for one in own))
    enters = ENTERS.format(what=axis.what, such=axis.such, through=", ".join(names) or "there are no two of them here")
    told = TransferCurve(enters, names)
    if not points:
        return replace(told, sentence="No such condition was flown: nothing can be read from a curve.")
    usual = _usual_mm(points)
    whole = fieller(usual, usual) if len(usual) > 1 else None
    if usual.mean() == 0.0 or (whole is not None and whole.value is None):
        why = "The error after familiarisation cannot be distinguished from 0, so transfer is not defined."
        return replace(told, sentence=why)
    drawn = [
        DrawnPoint(one.person, one.condition, one.x, one.condition in names,
                   (one.familiarised_mm - one.trained_mm) / float(usual.mean()))
        for one in points
    ]  # fmt: skip
    if not own:
        why = f"No two conditions that differ only by {axis.what} were flown: there is no curve."
        return replace(told, points=drawn, sentence=why)
    people, slope = sorted({one.person for one in own}), _slope(own, axis)
    sentence = _sentence(slope, len(people), names)
    curve = _monotone(own, people, axis.scale)
    return TransferCurve(enters, names, drawn, curve, slope, len(people), sentence)


def _usual_mm(points: Sequence[CurvePoint]) -> Float[np.ndarray, " person"]:
    """Error after familiarisation, once per person [mm]."""
    by_person = {one.person: one.familiarised_mm for one in points}
    return np.array([by_person[person] for person in sorted(by_person)])


def _slope(points: Sequence[CurvePoint], axis: Axis) -> Slope:
    """Mean slope of the people's straight lines through their own conditions, relative to the usual error."""
    by_person = dict[int, list[CurvePoint]]()
    for one in points:
        by_person.setdefault(one.person, []).append(one)
    slopes, usual = list[float](), list[float]()
    for own in by_person.values():
        x = axis.scale(np.array([one.x for one in own]))
        off = x - x.mean()
        if off @ off > ALIKE * (1.0 + x @ x):
            away = np.array([one.familiarised_mm - one.trained_mm for one in own])
            slopes.append(float(off @ away / (off @ off)))
            usual.append(own[0].familiarised_mm)
    found = fieller(np.array(slopes), np.array(usual))
    return Slope(found.value, ends_of(found.interval), found.reason or None, axis.step)


def _monotone(points: Sequence[CurvePoint], people: Sequence[int], scale: Callable[[Xs], Xs]) -> FallingCurve:
    """Fit a curve that never rises, of no given shape. The band comes from resampled people with all their points."""
    x = np.array([one.x for one in points])
    ends = scale(np.array([x.min(), x.max()]))
    grid = np.linspace(ends[0], ends[1], GRID)
    of = {person: [one for one in points if one.person == person] for person in people}
    middle = _falling(points, scale, grid)
    at = 10.0**grid if abs(float(scale(np.array([10.0]))[0]) - 1.0) < 1e-9 else grid
    if len(people) < BAND_FROM:
        return FallingCurve(at.tolist(), middle.tolist(), None, None, f"no band: fewer than {BAND_FROM} people")
    drawn = np.array([_drawn(of, people, row, scale, grid) for row in resamples(len(people)).tolist()])
    bands = [interval(column) for column in drawn.T]
    lows, highs = [low for low, _ in bands], [high for _, high in bands]
    return FallingCurve(at.tolist(), middle.tolist(), lows, highs, None)


def _drawn(
    of: Mapping[int, Sequence[CurvePoint]],
    people: Sequence[int],
    row: Sequence[int],
    scale: Callable[[Xs], Xs],
    grid: Xs,
) -> Xs:
    return _falling([one for k in row for one in of[people[k]]], scale, grid, [of[people[k]][0] for k in row])


def _falling(
    points: Sequence[CurvePoint], scale: Callable[[Xs], Xs], grid: Xs, people: Sequence[CurvePoint] | None = None
) -> Xs:
    """Fit the curve that never rises and is nearest to the conditions' means. `people` has one point per person."""
    usual = _usual_mm(points) if people is None else np.array([one.familiarised_mm for one in people])
    x = scale(np.array([one.x for one in points]))
    y = np.array([one.familiarised_mm - one.trained_mm for one in points])
    # The curve uses the means of each condition, whose machines are much alike. Through the points of single people it
    # would follow their noise.
    _, where, counts = np.unique([one.condition for one in points], return_inverse=True, return_counts=True)
    at, means = np.bincount(where, x) / counts, np.bincount(where, y) / counts
    # Conditions at the same place are merged.
    at, same, weights = _merged(at, counts.astype(float))
    means = np.bincount(same, means * counts) / weights
    fitted = optimize.isotonic_regression(means, weights=weights, increasing=False).x
    return np.interp(grid, at, fitted) / usual.mean()


def _merged(
    at: Float[np.ndarray, " condition"], counts: Float[np.ndarray, " condition"]
) -> tuple[Float[np.ndarray, " place"], Int[np.ndarray, " condition"], Float[np.ndarray, " place"]]:
    """Merge equal places: the places in order, the place of each condition, and the number of points at each place."""
    places, same = np.unique(at, return_inverse=True)
    return places, same, np.bincount(same, counts)


def _sentence(slope: Slope, people: int, names: Sequence[str]) -> str:
    who = "one person" if people == 1 else f"{people} people"
    if slope.value is None:
        return f"The slope cannot be determined: {slope.reason}."
    said = f"With {slope.per} transfer changes by {slope.value:+.2f}".replace("-", "−") + f" over {', '.join(names)}"
    if slope.ci95 is None:
        return f"{said} ({who}; no interval: {slope.reason})."
    low, high = (f"{end:+.2f}".replace("-", "−") for end in slope.ci95)
    said = f"{said} (95 % interval {low} to {high}, {who})"
    if slope.ci95[0] <= 0.0 <= slope.ci95[1]:
        return f"{said}: a change is not shown."
    return f"{said}: it {'falls' if slope.value < 0 else 'rises'}."
