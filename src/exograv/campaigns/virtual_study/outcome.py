"""Figures of all flights of a virtual study: groups, conditions, and the test of the paper's direction of effect."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from jaxtyping import Float

from exograv.errors import ConfigError
from exograv.study.dataset.tables import frame
from exograv.study.folder.columns import PARTICIPANTS
from exograv.study.statistics.compare import CompareSettings, compare
from exograv.study.statistics.findings import Spread
from exograv.study.statistics.normal import welch_interval
from exograv.study.statistics.people import spread_of
from exograv.study.statistics.permutation import permutation_test
from exograv.study.statistics.relabelling import relabellings

from .curve import TransferCurve, by_friction, by_left_over
from .flight import FIRST_WINDOW, VirtualFlight, compared, familiarised
from .transfer import DEFINITION, ConditionTransfer, constant_error_mm, ends_of, transfers

GROUPS = ("trained", "untrained")
ALPHA = 0.05
NO_INTERVAL = "fewer than two people in a group: no interval"
NO_EVIDENCE = "Simulated: nobody took part. It shows that the software works; it is no evidence about people."

PerPerson = Float[np.ndarray, " person"]


@dataclass(frozen=True)
class Medians:
    """Deviation of the touches in flight [px], as the study's report computes it: every person has the same weight."""

    median_px: float | None
    iqr_px: float | None
    quartiles_px: list[float] | None
    touches: int
    median_px_by_person: dict[str, float]


@dataclass(frozen=True)
class GroupFigures(Medians):
    """Figures of one group of the main study."""

    people: int
    first_window_up_mm_by_person: dict[str, float]


@dataclass(frozen=True)
class TrainingMachine:
    """Condition and its machine, median over people."""

    condition: str
    sessions: int
    left_over_Nm: float | None
    friction_Nm: float | None


@dataclass(frozen=True)
class ConditionFigures(ConditionTransfer, TrainingMachine, Medians):
    """Figures of one condition: the fields of `Medians`, `TrainingMachine` and `ConditionTransfer`, and its own."""

    sessions_familiarised: list[int]
    """Numbers of sessions before the reference flights."""


@dataclass(frozen=True)
class Verdict:
    """Verdict on a group difference. It is shown if p is at most `ALPHA` and the 95 % interval excludes equality."""

    appears: bool
    is_shown: bool
    is_opposite_shown: bool


@dataclass(frozen=True)
class PairsNearer:
    """Pairs of a trained and an untrained person in which the trained person is nearer to the target."""

    pairs_nearer: int
    pairs: int


@dataclass(frozen=True)
class DeviationComparison(PairsNearer, Verdict):
    """Ratio of the deviation, trained over untrained."""

    ratio: float
    ci95: list[float] | None
    p: float | None
    p_min: float | None
    p_text: str
    sentence: str
    limits: list[str]
    reason: str | None
    """Reason why `ci95` is None; None if there is an interval."""


@dataclass(frozen=True)
class ErrorComparison(PairsNearer, Verdict):
    """Difference of the size of the signed error, trained minus untrained."""

    trained_mm: float
    untrained_mm: float
    trained_size_mm: float
    untrained_size_mm: float
    difference_mm: float
    ci95: list[float] | None
    p: float | None
    p_min: float | None
    p_text: str
    sentence: str
    reason: str | None
    """Reason why `ci95` is None; None if there is an interval."""


@dataclass(frozen=True)
class NotCompared:
    """Reason for a missing comparison."""

    appears: None = field(default=None, init=False)
    reason: str


@dataclass(frozen=True)
class Direction:
    """Comparison of the trained and the untrained of the main study, as in the paper."""

    whole_flight: DeviationComparison | NotCompared
    first_window: DeviationComparison | NotCompared
    first_window_up_mm: ErrorComparison | NotCompared


@dataclass(frozen=True)
class TransferOutcome:
    """Transfer against left over, and against friction."""

    definition: str
    by_left_over: TransferCurve
    by_friction: TransferCurve


@dataclass(frozen=True)
class StudyOutcome:
    """Figures of all flights."""

    simulated: bool
    note: str
    main: str
    """Condition of the trained group of the main study."""

    groups: dict[str, GroupFigures]
    direction: Direction
    conditions: dict[str, ConditionFigures]
    transfer: TransferOutcome


def outcome_of(flights: Sequence[VirtualFlight], main: str) -> StudyOutcome:
    """Compute the figures of all flights; `main` is the condition of the main study's trained group.

    Raises:
        ConfigError: A person flew twice in the same condition, or there is no flight.
    """
    _refuse(flights)
    found, before = transfers(flights), familiarised(flights)
    conditions = {}
    for name, own in compared(flights).items():
        usual = {before[flight.person].sessions for flight in own if flight.person in before}
        parts = vars(_medians(touches_of(own), name)) | vars(_machine(own)) | vars(found[name])
        conditions[name] = ConditionFigures(**parts, sessions_familiarised=sorted(usual))
    return StudyOutcome(
        True, NO_EVIDENCE, main, {group: _group(flights, group) for group in GROUPS}, direction(flights),
        conditions, TransferOutcome(DEFINITION, by_left_over(flights), by_friction(flights)),
    )  # fmt: skip


def _refuse(flights: Sequence[VirtualFlight]) -> None:
    if not flights:
        raise ConfigError("No person flew: there are no figures. Give --participants of 1 or more.")
    keys = [(flight.person, flight.condition, flight.group, flight.sessions) for flight in flights]
    if twice := sorted({key for key in keys if keys.count(key) > 1}):
        person, condition, group, sessions = twice[0]
        raise ConfigError(
            f"Person {person} flew twice after '{condition}' ({group}, {sessions} sessions); one flight per person "
            "counts. Leave one of the flights out."
        )


def code_of(person: int) -> str:
    """Code of a virtual person in tables and figures."""
    return f"V{person:02d}"


def touches_of(flights: Sequence[VirtualFlight]) -> pd.DataFrame:
    """Table of touches for `study.statistics`; `group` is the group of the main study, or else the condition."""
    return pd.DataFrame(
        [
            {
                "participant": code_of(flight.person),
                "protocol": "flight",
                "session": 1,
                "window": float(touch.window),
                "is_accepted": True,
                "deviation_px": touch.deviation_px,
                "deviation_mm": touch.deviation_mm,
                "deviation": touch.deviation_px,
                "group": flight.group if flight.group in GROUPS else flight.condition,
            }
            for flight in flights
            for touch in flight.touches
        ]
    )


def _medians(touches: pd.DataFrame, label: str) -> Medians:
    spread = Spread(0, 0, None, None)
    if not touches.empty:
        spread = spread_of(touches.assign(group=label), label)
    by_person = {} if touches.empty else touches.groupby("participant")["deviation_px"].median().to_dict()
    return Medians(
        spread.median, spread.iqr, spread.quartiles and list(spread.quartiles), spread.touches,
        {str(code): float(value) for code, value in by_person.items()},
    )  # fmt: skip


def _machine(own: Sequence[VirtualFlight]) -> TrainingMachine:
    found = dict[str, float | None]()
    for name in ("left_over_Nm", "friction_Nm"):
        values = [value for flight in own if (value := getattr(flight, name)) is not None]
        found[name] = float(np.median(values)) if values else None
    return TrainingMachine(own[0].condition, own[0].sessions, **found)


def _group(flights: Sequence[VirtualFlight], group: str) -> GroupFigures:
    own = [flight for flight in flights if flight.group == group]
    errors = {code_of(flight.person): constant_error_mm(flight) for flight in own}
    return GroupFigures(
        **vars(_medians(touches_of(own), group)),
        people=len({flight.person for flight in own}),
        first_window_up_mm_by_person={code: float(mm) for code, mm in errors.items() if np.isfinite(mm)},
    )


def direction(flights: Sequence[VirtualFlight]) -> Direction:
    """Compare the trained and the untrained of the main study: less deviation, as in the paper, or not."""
    own = [flight for flight in flights if flight.group in GROUPS]
    if missing := [group for group in GROUPS if not any(flight.group == group for flight in own)]:
        nothing = NotCompared(f"No person of the group {' or '.join(missing)} flew.")
        return Direction(nothing, nothing, nothing)
    people = frame(PARTICIPANTS, [{"participant": code_of(one.person), "group": one.group} for one in own])
    touches = touches_of(own)
    first = pd.DataFrame(touches[touches["window"] == FIRST_WINDOW])
    return Direction(_compared(touches, people), _compared(first, people), _signed(own))


def _compared(touches: pd.DataFrame, people: pd.DataFrame) -> DeviationComparison | NotCompared:
    settings = CompareSettings(groups=GROUPS, mixed=False, bayes=False)
    found = compare(touches.drop(columns=["group", "deviation"]), people, settings)
    if found.effect.value is None:
        return NotCompared(found.primary.sentence)
    medians = [
        touches[touches["group"] == group].groupby("participant")["deviation_px"].median().to_numpy(float)
        for group in GROUPS
    ]
    interval, test = ends_of(found.effect.interval), found.primary
    return DeviationComparison(
        **vars(_verdict(found.effect.value, 1.0, interval, test.p)), **vars(_nearer(*medians)),
        ratio=found.effect.value, ci95=interval, p=test.p, p_min=test.p_min, p_text=test.text, sentence=test.sentence,
        limits=list(found.limits), reason=None if interval else NO_INTERVAL,
    )  # fmt: skip


def _signed(own: Sequence[VirtualFlight]) -> ErrorComparison | NotCompared:
    groups = [np.array([constant_error_mm(flight) for flight in own if flight.group == group]) for group in GROUPS]
    trained, untrained = (values[np.isfinite(values)] for values in groups)
    if min(len(trained), len(untrained)) == 0:
        return NotCompared("No person of one group has a touch in the first window.")
    sizes = np.abs(trained), np.abs(untrained)  # An error upwards and the same error downwards are equally near.
    difference, welch = welch_interval(*sizes)
    interval = ends_of(welch)
    ways = relabellings(len(trained), len(untrained), np.random.default_rng(0))
    test = permutation_test(np.concatenate(sizes), ways, ALPHA)
    return ErrorComparison(
        **vars(_verdict(difference, 0.0, interval, test.p)), **vars(_nearer(*sizes)),
        trained_mm=float(trained.mean()), untrained_mm=float(untrained.mean()),
        trained_size_mm=float(sizes[0].mean()), untrained_size_mm=float(sizes[1].mean()), difference_mm=difference,
        ci95=interval, p=test.p, p_min=test.p_min, p_text=test.text, sentence=test.sentence,
        reason=None if interval else NO_INTERVAL,
    )  # fmt: skip


def _verdict(value: float, none: float, ci95: Sequence[float] | None, p: float | None) -> Verdict:
    """Compare `value` with the value of no effect. An effect is shown only by the test and the interval together."""
    is_told = p is not None and p <= ALPHA and ci95 is not None and not ci95[0] <= none <= ci95[1]
    return Verdict(value < none, is_told and value < none, is_told and value > none)


def _nearer(trained: PerPerson, untrained: PerPerson) -> PairsNearer:
    return PairsNearer(int((trained[:, None] < untrained[None, :]).sum()), len(trained) * len(untrained))
