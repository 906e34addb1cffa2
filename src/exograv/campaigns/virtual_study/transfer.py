"""Transfer: the share of a person's first error in weightlessness that a training removed."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from exograv.study.statistics.fieller import Ratio, fieller, mean_interval
from exograv.study.statistics.findings import Interval

from .flight import FAMILIARISED, VirtualFlight, compared, familiarised

DEFINITION = (
    "Transfer is 1 − E/E₀. E is the mean, over people, of the signed constant error in the first window of the flight "
    "after this training. The constant error is the mean height over the window's accepted touches. E₀ is the same of "
    "the same people after familiarisation only. 1: no error was left; 0: the training had no effect; below 0: it did "
    "harm; above 1: the error was on the other side. Flights that compare conditions are used; those of the main "
    "study only for a condition without others. People without an accepted touch in window 1 of both flights are left "
    "out. The 95 % interval is Fieller's over people."
)

Measure = Callable[[VirtualFlight], float]


def constant_error_mm(flight: VirtualFlight) -> float:
    """Mean height above the target in the first window [mm]; NaN without a touch there."""
    return _mean([touch.up_mm for touch in flight.first_window])


def first_touch_mm(flight: VirtualFlight) -> float:
    """Height of the first accepted touch [mm]; NaN without one in the first window."""
    return _mean([touch.up_mm for touch in flight.first_window if touch.number == 1])


def first_deviation_mm(flight: VirtualFlight) -> float:
    """Median deviation in the first window, in any direction [mm]; NaN without a touch there."""
    found = [touch.deviation_mm for touch in flight.first_window]
    return float(np.median(found)) if found else float("nan")


def _mean(values: list[float]) -> float:
    return float(np.mean(values)) if values else float("nan")


SECONDARY: Mapping[str, Measure] = {"first_touch": first_touch_mm, "median_deviation": first_deviation_mm}


@dataclass(frozen=True)
class PairedCareers:
    """Errors of the same people after a training and after familiarisation only."""

    people: tuple[int, ...]
    trained: Float[np.ndarray, " person"]
    familiarised: Float[np.ndarray, " person"]
    left_out: tuple[int, ...]
    """People of the condition for whom one of the two is missing."""

    @property
    def ratio(self) -> Ratio:
        """Ratio of the means, trained over familiarised."""
        return fieller(self.trained, self.familiarised)


def pairs(
    flights: Iterable[VirtualFlight], before: Mapping[int, VirtualFlight], measure: Measure = constant_error_mm
) -> PairedCareers:
    """Pair the flights of a condition with those of the same people in `before`."""
    whole, left_out = dict[int, tuple[float, float]](), list[int]()
    for flight in flights:
        other = before.get(flight.person)
        values = (measure(flight), measure(other) if other is not None else float("nan"))
        if np.isfinite(values).all():
            whole[flight.person] = values
        else:
            left_out.append(flight.person)
    people = tuple(sorted(whole))
    values = np.array([whole[person] for person in people]).reshape(-1, 2)
    return PairedCareers(people, values[:, 0], values[:, 1], tuple(sorted(left_out)))


@dataclass(frozen=True)
class TransferFigures:
    """Transfer (`DEFINITION`) by one measure of the error, with its 95 % interval."""

    transfer: float | None
    ci95: list[float] | None
    reason: str | None
    """Reason why a value is missing; None if all values exist."""


@dataclass(frozen=True)
class ConditionTransfer(TransferFigures):
    """Transfer of one condition by the first window's constant error, and by secondary measures."""

    people: int
    left_out_people: int
    first_window_up_mm: float | None
    first_window_up_mm_ci95: list[float] | None
    first_touch: TransferFigures
    median_deviation: TransferFigures


@dataclass(frozen=True)
class TransferChange:
    """Difference of transfer from the usual one of the same people."""

    change: float | None = None
    ci95: list[float] | None = None
    reason: str | None = None
    """Reason why a value is missing; None if all values exist."""


def transfer(found: PairedCareers) -> TransferFigures:
    """Transfer of these pairs."""
    ratio = found.ratio
    ends = ends_of(ratio.interval)
    value = None if ratio.value is None else 1.0 - ratio.value
    # 1 − ratio swaps the ends of the interval.
    return TransferFigures(value, ends and [1.0 - ends[1], 1.0 - ends[0]], ratio.reason or None)


def change(own: PairedCareers, usual: PairedCareers) -> TransferChange:
    """Difference of transfer from the usual one of the same people.

    Each person's share in it is z = (E − ratio·E₀) / mean(E₀), usual minus own. Its mean over people is 0, and the
    interval is Student's t of it about the change. This is a first-order approximation; E₀ must be well away from 0.
    """
    people = sorted(set(own.people) & set(usual.people))
    if not people:
        return TransferChange(reason="no person has flights in both")
    found, shares = list[float](), list[Float[np.ndarray, " person"]]()
    for one in (usual, own):
        where = [one.people.index(person) for person in people]
        trained, before = one.trained[where], one.familiarised[where]
        ratio = fieller(trained, before)
        if ratio.value is None:
            return TransferChange(reason=ratio.reason)
        found.append(ratio.value)
        shares.append((trained - ratio.value * before) / before.mean())
    value = found[0] - found[1]
    interval = mean_interval(value + shares[0] - shares[1])
    reason = None if interval else "one person: nothing is known of how people differ"
    return TransferChange(value, ends_of(interval), reason)


def ends_of(interval: Interval | None) -> list[float] | None:
    """Return the ends of an interval for JSON; None without two ends."""
    if interval is None or interval.low is None or interval.high is None:
        return None
    return [interval.low, interval.high]


def transfers(flights: Iterable[VirtualFlight]) -> dict[str, ConditionTransfer]:
    """Compute transfer of each condition."""
    flights = list(flights)
    before = familiarised(flights)
    return {name: _of_condition(own, before) for name, own in compared(flights).items()}


def _of_condition(own: tuple[VirtualFlight, ...], before: Mapping[int, VirtualFlight]) -> ConditionTransfer:
    if own[0].condition == FAMILIARISED:
        told = TransferFigures(None, None, "it is the reference of the comparison")
        others = dict.fromkeys(SECONDARY, told)
        errors = np.array([constant_error_mm(flight) for flight in own])
        errors = errors[np.isfinite(errors)]
        people, left_out = len(errors), len(own) - len(errors)
    else:
        found = pairs(own, before)
        told, errors = transfer(found), found.trained
        others = {name: transfer(pairs(own, before, measure)) for name, measure in SECONDARY.items()}
        people, left_out = len(found.people), len(found.left_out)
    return ConditionTransfer(
        **vars(told),
        people=people,
        left_out_people=left_out,
        first_window_up_mm=float(errors.mean()) if len(errors) else None,
        first_window_up_mm_ci95=ends_of(mean_interval(errors)),
        first_touch=others["first_touch"],
        median_deviation=others["median_deviation"],
    )
