"""Sentences on the figures of a virtual study, limited to what the figures support."""

from collections.abc import Iterator, Mapping, Sequence

from exograv.report.study_report.results import number

from . import ablation
from .ablation import Ablated
from .figure_sensitivity import SensitivityPoint
from .flight import FAMILIARISED
from .outcome import (
    ALPHA,
    ConditionFigures,
    DeviationComparison,
    Direction,
    ErrorComparison,
    NotCompared,
    StudyOutcome,
)

MECHANISM = (
    "No effect is built in. The effect of a training comes from how the arm felt in it: a person recalls what was "
    "learned at a similar felt weight, and corrects the aim by the errors seen. The person does not know the name of "
    "the condition."
)


def headline(outcome: StudyOutcome) -> str:
    """Sentence on whether the paper's direction of effect appears."""
    whole = outcome.direction.whole_flight
    if whole.appears is None:
        return "Simulated flights after different trainings, compared by what was left of the first error."
    medians = ", ".join(
        f"{number(outcome.groups[group].median_px or 0.0)} px {group}" for group in ("trained", "untrained")
    )
    if whole.is_shown:
        verb = "is shown"
    elif whole.is_opposite_shown:
        verb = "does not appear; the opposite is shown"
    else:
        verb = f"{'appears and' if whole.appears else 'does not appear, and the opposite'} is not shown"
    said = f"Simulated: the published direction of effect {verb} ({whole.p_text})"
    return f"{said}, median deviation in flight {medians}."


def sentences(
    outcome: StudyOutcome,
    swept: Sequence[SensitivityPoint] = (),
    usual: float | None = None,
    ablated: Sequence[Ablated] = (),
) -> list[str]:
    """Sentences on direction, mechanism, conditions and sensitivity; `usual` is transfer before the sweep."""
    mechanism = [MECHANISM, *ablation.sentences(ablated)]
    return [*_direction(outcome.direction), *mechanism, *_conditions(outcome), *_swept(swept, usual)]


def _direction(direction: Direction) -> Iterator[str]:
    for name, words in (("whole_flight", "Over the whole flight"), ("first_window", "In the first window")):
        of: DeviationComparison | NotCompared = getattr(direction, name)
        if of.appears is None:
            yield f"{words} nothing is compared: {of.reason}"
        else:
            ratio = f"ratio {number(of.ratio)}{_interval(of)}{_test(of)}"
            yield f"{words} the trained deviate less {_in_pairs(of)}; {ratio}"
    error = direction.first_window_up_mm
    if error.appears is not None:
        yield (
            f"The first window's constant error is {number(error.trained_mm)} mm for the trained and "
            f"{number(error.untrained_mm)} mm for the untrained, positive upwards. By its size the trained are nearer "
            f"{_in_pairs(error)}; difference of the mean sizes {number(error.difference_mm)} mm"
            f"{_interval(error)}{_test(error)}"
        )


def _in_pairs(of: DeviationComparison | ErrorComparison) -> str:
    return f"in {of.pairs_nearer} of {of.pairs} pairs of a trained and an untrained person"


def _test(of: DeviationComparison | ErrorComparison) -> str:
    """Clause on the joint result of test and interval."""
    if of.is_shown or of.is_opposite_shown:
        told = "that the trained are " + ("nearer" if of.is_shown else "farther off") + " is shown by both"
    elif of.p_min is not None and of.p_min > ALPHA:
        told = f"with so few people no test can show anything: p cannot be below {number(of.p_min)}"
    else:
        told = "test and interval together show no difference"
    return f", exact {of.p_text}: {told}."


def _interval(of: DeviationComparison | ErrorComparison) -> str:
    ends = of.ci95
    return " (no interval)" if ends is None else f" (95 % interval {number(ends[0])} to {number(ends[1])})"


def _conditions(outcome: StudyOutcome) -> Iterator[str]:
    told = {name: of for name, of in outcome.conditions.items() if of.condition != FAMILIARISED}
    yield from _sessions(told)
    kinds = (
        ("The 95 % interval of transfer lies above 0 after", lambda low, high: low > 0.0),
        ("It holds 0, so that it is open whether anything was taken away, after", lambda low, high: low <= 0.0 <= high),
        ("It lies below 0, so that the flight was worse than without, after", lambda low, high: high < 0.0),
    )
    for words, holds in kinds:
        names = [
            f"{name} (transfer {number(of.transfer)})"
            for name, of in told.items()
            if of.ci95 is not None and of.transfer is not None and holds(*of.ci95)
        ]
        if names:
            yield f"{words} {', '.join(names)}."
    if untold := [f"{name} ({of.reason})" for name, of in told.items() if of.ci95 is None]:
        yield f"The interval of transfer cannot be determined for {'; '.join(untold)}."
    for name in ("by_left_over", "by_friction"):
        what = "What is left over" if name == "by_left_over" else "Friction"
        yield f"{what}: {getattr(outcome.transfer, name).sentence}"


def _sessions(told: Mapping[str, ConditionFigures]) -> Iterator[str]:
    """Sentences on the number of sessions before each flight. A difference of practice is part of the transfer."""
    by_number = dict[tuple[int, tuple[int, ...]], list[str]]()
    for name, of in told.items():
        if of.sessions_familiarised:
            by_number.setdefault((of.sessions, tuple(of.sessions_familiarised)), []).append(name)
    for (trained, usual), names in by_number.items():
        said = f"Sessions before the flight of {', '.join(names)}: {trained} before E, {' or '.join(map(str, usual))}"
        more = "" if usual == (trained,) else "; transfer includes the practice in the additional sessions"
        yield f"{said} before E₀{more}."


def _swept(swept: Sequence[SensitivityPoint], usual: float | None) -> Iterator[str]:
    if not swept or usual is None:
        return
    gone = [f"{row.name} = {row.value:g}" for row in swept if row.transfer is not None and vanishes(row, usual)]
    held = [row for row in swept if row.transfer is not None]
    if gone:
        yield f"With {', '.join(gone)} transfer is less than half of {number(usual)}, or may be 0."
    elif held:
        yield "No constant alone, at an end of its plausible range, takes half of the transfer away."
    if untold := [f"{row.name} = {row.value:g}" for row in swept if row.transfer is None]:
        yield f"With {', '.join(untold)} no transfer can be told: the error after familiarisation may be 0."


def vanishes(row: SensitivityPoint, usual: float) -> bool:
    """Return True if less than half of the usual transfer remains, or if transfer may be zero."""
    is_small = row.transfer is not None and row.transfer < 0.5 * usual
    return is_small or (row.ci95 is not None and row.ci95[0] <= 0.0)
