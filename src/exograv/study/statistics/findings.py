"""What a comparison of two groups found, as values that go into a page or a JSON file unchanged."""

from dataclasses import dataclass, field
from typing import Literal

from exograv.results import OPTIONAL

Unit = Literal["px", "mm"]
EXACT = "exact permutation"
DRAWN = "permutation, drawn at random"


@dataclass(frozen=True)
class Interval:
    """Where a quantity is likely to be."""

    low: float | None
    """None where it is without bound."""

    high: float | None
    level: float
    """Share of studies in which such an interval holds the truth, where its assumptions are right."""

    method: str


@dataclass(frozen=True)
class Effect:
    """How much the first group differs from the second."""

    name: str
    value: float | None
    """None where there are too few people."""

    unit: str
    interval: Interval | None
    meaning: str
    """How to read it, one sentence."""


@dataclass(frozen=True)
class Test:
    """Whether chance alone does as much."""

    __test__ = False  # pytest would take it for one of its own
    name: str
    p: float | None
    """Two-sided; None where there is nothing to test."""

    p_interval: tuple[float, float] | None
    """99 % interval of p where relabellings were drawn; None where all were counted."""

    p_min: float | None
    """Smallest that the people at hand allow, whatever the effect; None where the test has no such bound."""

    p_min_reason: str
    """Why, one sentence."""

    text: str
    """The p-value as it may be printed."""

    sentence: str
    """What follows, for a reader who knows no statistics."""


@dataclass(frozen=True)
class ParticipantValue:
    """One participant's touches in one number."""

    participant: str
    group: str
    touches: int
    median: float
    """Deviation, median over the touches [unit of the findings]."""

    log_median: float
    """Median of its natural logarithm."""


@dataclass(frozen=True)
class Spread:
    """Touches of a group; each person weighs the same, however many touches there are."""

    people: int
    touches: int
    median: float | None
    quartiles: tuple[float, float] | None
    iqr: float | None = field(init=False)
    """Distance between the quartiles."""

    def __post_init__(self):
        iqr = None if self.quartiles is None else self.quartiles[1] - self.quartiles[0]
        object.__setattr__(self, "iqr", iqr)


@dataclass(frozen=True)
class MixedFit:
    """Linear mixed model of log deviation, people as random intercepts; secondary."""

    formula: str
    ratio: float | None
    """First group over second, in the middle of the session."""

    interval: Interval | None
    p_wald: float | None
    p_between: float | None
    """By Student's t with people less groups as degrees of freedom."""

    change_per_window: float | None
    """By how much the difference in log deviation grows from window to window."""

    p_change: float | None
    """Wald, of `change_per_window`."""

    person_sd: float | None
    """Between people of a group [log units]."""

    touch_sd: float | None
    """Between touches of a person [log units]."""

    converged: bool
    remarks: tuple[str, ...]
    """What the fit complained about, and the caveat."""


@dataclass(frozen=True)
class Posterior:
    """What one prior makes of the data."""

    effect_prior_sd: float
    """Of the difference in log deviation: normal about zero."""

    person_prior_scale: float
    """Of the standard deviation between people: half t with three degrees of freedom."""

    ratio: float
    """Median."""

    interval: Interval
    """95 %, equal tails."""

    p_smaller: float
    """Probability that the first group deviates less."""

    person_sd: float
    """Median [log units]."""

    person_sd_interval: Interval


@dataclass(frozen=True)
class BayesFit:
    """Hierarchical model under several priors; the first is the one to quote, the others show what it depends on."""

    posteriors: tuple[Posterior, ...]
    convention: str
    sentence: str


@dataclass(frozen=True)
class StudyFindings:
    """Everything that is said about two groups."""

    groups: tuple[str, str]
    protocol: str
    unit: Unit
    people: tuple[ParticipantValue, ...]
    left_out: tuple[str, ...]
    """Who or what was not counted, and why; one sentence each."""

    spread: dict[str, Spread]
    """By group."""

    primary: Test
    effect: Effect
    """Ratio of geometric means of the participants' medians, first group over second."""

    other_tests: tuple[Test, ...]
    other_effects: tuple[Effect, ...]
    mixed: MixedFit | None
    bayes: BayesFit | None
    limits: tuple[str, ...]
    """What this many people can show and what not, one sentence each."""

    methods: tuple[str, ...] = field(default=())
    """Sentences for the methods paragraph."""

    def contract(self) -> "ComparisonFigures":
        """The figures that `exograv study report --json` promises."""
        interval = self.effect.interval
        primary = PrimaryFigures(
            self.primary.name,
            self.primary.p,
            self.primary.p_min,
            self.primary.text,
            self.effect.value,
            self.effect.name,
            None if interval is None else (interval.low, interval.high),
            None if interval is None else interval.method,
        )
        deviation = {
            group: DeviationFigures(spread.median, spread.iqr, spread.quartiles)
            for group, spread in self.spread.items()
        }
        return ComparisonFigures(
            {group: self.spread[group].people for group in self.groups},
            sum(spread.touches for spread in self.spread.values()),
            deviation if self.unit == "px" else None,
            deviation if self.unit == "mm" else None,
            primary,
        )


@dataclass(frozen=True)
class DeviationFigures:
    """Deviation of a group's touches, in the unit that the name says."""

    median: float | None
    iqr: float | None
    quartiles: tuple[float, float] | None


@dataclass(frozen=True)
class PrimaryFigures:
    """Primary comparison."""

    test: str
    p: float | None
    p_min: float | None
    p_text: str
    effect: float | None
    effect_name: str
    ci95: tuple[float | None, float | None] | None
    ci95_method: str | None


@dataclass(frozen=True)
class ComparisonFigures:
    """Comparison of a study's groups in short."""

    participants: dict[str, int]
    touches: int
    deviation_px: dict[str, DeviationFigures] | None = field(default=None, metadata=OPTIONAL)
    deviation_mm: dict[str, DeviationFigures] | None = field(default=None, metadata=OPTIONAL)
    primary: PrimaryFigures | None = None
    not_compared: str | None = field(default=None, metadata=OPTIONAL)
    """Why nothing is compared."""
