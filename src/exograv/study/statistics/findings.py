"""Findings of a comparison of two groups, as values that a page or a JSON file takes unchanged."""

from dataclasses import dataclass, field
from typing import Literal

from exograv.results import OPTIONAL

Unit = Literal["px", "mm"]
EXACT = "exact permutation"
DRAWN = "permutation, drawn at random"


@dataclass(frozen=True)
class Interval:
    """Confidence or credible interval of a quantity."""

    low: float | None
    """Lower end; None if the interval is unbounded below."""

    high: float | None
    level: float
    """Share of studies in which such an interval holds the true value, if its assumptions hold."""

    method: str


@dataclass(frozen=True)
class Effect:
    """Size of the difference between the first group and the second."""

    name: str
    value: float | None
    """Estimate; None with too few people."""

    unit: str
    interval: Interval | None
    meaning: str
    """Interpretation of the value, one sentence."""


@dataclass(frozen=True)
class Test:
    """Result of a test of the hypothesis that chance alone explains the difference."""

    __test__ = False  # Pytest would otherwise collect the class as a test.
    name: str
    p: float | None
    """Two-sided p-value; None if no test is possible."""

    p_interval: tuple[float, float] | None
    """99 % interval of p if relabellings were drawn at random; None if all were enumerated."""

    p_min: float | None
    """Smallest p-value that these people allow for any effect; None if the test has no such bound."""

    p_min_reason: str
    """Reason for this bound, one sentence."""

    text: str
    """P-value as it may be printed."""

    sentence: str
    """Conclusion for a reader without knowledge of statistics."""


@dataclass(frozen=True)
class ParticipantValue:
    """Touches of one participant, summarised by one number."""

    participant: str
    group: str
    touches: int
    median: float
    """Median deviation over the touches [unit of the findings]."""

    log_median: float
    """Median of the deviation's natural logarithm."""


@dataclass(frozen=True)
class Spread:
    """Distribution of a group's touches. Each person has the same weight, independent of the number of touches."""

    people: int
    touches: int
    median: float | None
    quartiles: tuple[float, float] | None
    iqr: float | None = field(init=False)
    """Interquartile range, in the unit of `median`; None without quartiles."""

    def __post_init__(self):
        iqr = None if self.quartiles is None else self.quartiles[1] - self.quartiles[0]
        object.__setattr__(self, "iqr", iqr)


@dataclass(frozen=True)
class MixedFit:
    """Linear mixed model of log deviation, people as random intercepts; a secondary analysis."""

    formula: str
    ratio: float | None
    """Ratio of the deviation of the first group to that of the second, in the middle of the session [-]; None if the
    fit failed."""

    interval: Interval | None
    p_wald: float | None
    p_between: float | None
    """P-value by Student's t, with the number of people minus the number of groups as degrees of freedom."""

    change_per_window: float | None
    """Change per window of the difference in log deviation between the groups [log units]; None if the fit failed."""

    p_change: float | None
    """Wald p-value of `change_per_window`; None if the fit failed."""

    person_sd: float | None
    """Standard deviation between people of a group [log units]; None if the fit failed."""

    touch_sd: float | None
    """Standard deviation between touches of a person [log units]; None if the fit failed."""

    converged: bool
    remarks: tuple[str, ...]
    """Warnings of the fit, and the caveat."""


@dataclass(frozen=True)
class Posterior:
    """Posterior of the data under one prior."""

    effect_prior_sd: float
    """Standard deviation of the normal prior, centred at zero, of the difference in log deviation."""

    person_prior_scale: float
    """Scale of the prior of the standard deviation between people: half t with three degrees of freedom."""

    ratio: float
    """Posterior median of the ratio."""

    interval: Interval
    """95 % interval with equal tails."""

    p_smaller: float
    """Probability that the first group deviates less."""

    person_sd: float
    """Posterior median of the standard deviation between people [log units]."""

    person_sd_interval: Interval


@dataclass(frozen=True)
class BayesFit:
    """Hierarchical model under several priors. The first is quoted; the others show the influence of the prior."""

    posteriors: tuple[Posterior, ...]
    convention: str
    sentence: str


@dataclass(frozen=True)
class StudyFindings:
    """All findings of the comparison of two groups."""

    groups: tuple[str, str]
    protocol: str
    unit: Unit
    people: tuple[ParticipantValue, ...]
    left_out: tuple[str, ...]
    """People and touches that were left out, and the reason; one sentence each."""

    spread: dict[str, Spread]
    """Distribution of the touches of each group, by the name of the group."""

    primary: Test
    effect: Effect
    """Ratio of geometric means of the participants' medians, first group to second."""

    other_tests: tuple[Test, ...]
    other_effects: tuple[Effect, ...]
    mixed: MixedFit | None
    bayes: BayesFit | None
    limits: tuple[str, ...]
    """Conclusions that this number of people allows or does not allow, one sentence each."""

    methods: tuple[str, ...] = field(default=())
    """Sentences for the methods paragraph."""

    def contract(self) -> "ComparisonFigures":
        """Return the figures that `exograv study report --json` guarantees."""
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
    """Deviation of a group's touches, in the unit of the field's name."""

    median: float | None
    iqr: float | None
    quartiles: tuple[float, float] | None


@dataclass(frozen=True)
class PrimaryFigures:
    """Figures of the primary comparison."""

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
    """Short form of the comparison of a study's groups."""

    participants: dict[str, int]
    touches: int
    deviation_px: dict[str, DeviationFigures] | None = field(default=None, metadata=OPTIONAL)
    deviation_mm: dict[str, DeviationFigures] | None = field(default=None, metadata=OPTIONAL)
    primary: PrimaryFigures | None = None
    not_compared: str | None = field(default=None, metadata=OPTIONAL)
    """Reason why the groups are not compared."""
