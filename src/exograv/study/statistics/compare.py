"""Comparison of two groups of people by their touches: the only entry point of the statistics."""

from dataclasses import dataclass, replace
from math import exp

import numpy as np
import pandas as pd

from exograv.errors import ConfigError

from .bayes import SENSITIVITY, bayes_fit
from .findings import EXACT, BayesFit, Effect, Interval, ParticipantValue, StudyFindings, Test, Unit
from .mixed import mixed_fit
from .normal import hedges_g, ratio_effect, welch_test
from .people import counted_touches, logs_of, people_of, spread_of
from .permutation import pair_interval, permutation_test, rank_test, reachable_level, shift_interval
from .precision import limits
from .random_intercept import sums_of
from .relabelling import COUNTED_MAX, Relabellings, relabellings


@dataclass(frozen=True)
class CompareSettings:
    """Groups, protocol and methods of a comparison."""

    groups: tuple[str, str] = ("trained", "untrained")
    """Names of the two groups. The ratio is that of the first to the second."""

    protocol: str = "flight"
    unit: Unit = "px"
    alpha: float = 0.05
    """Accepted probability of a false positive."""

    seed: int = 0
    """Seed of the random relabellings, which are used if there are too many to enumerate."""

    mixed: bool = True
    bayes: bool = True

    def __post_init__(self):
        """Check the settings.

        Raises:
            ConfigError: Both groups have the same name, or `alpha` is not between 0 and 0.5.
        """
        if self.groups[0] == self.groups[1]:
            raise ConfigError(f"Both groups are '{self.groups[0]}'; give two different groups of study.toml.")
        if not 0.0 < self.alpha < 0.5:
            raise ConfigError(f"alpha is {self.alpha:g}; it must lie between 0 and 0.5; the usual value is 0.05.")


def compare(
    touches: pd.DataFrame, participants: pd.DataFrame, settings: CompareSettings | None = None
) -> StudyFindings:
    """Compare two groups: the exact test over people first, then secondary tests and effects.

    Args:
        touches: Table `columns.TOUCHES`, such as those of complete windows. Rejected touches are left out, with a
        reason.
        participants: Table `columns.PARTICIPANTS`.
        settings: Groups, protocol and methods.

    Raises:
        ConfigError: Two participants have the same code.
    """
    settings = CompareSettings() if settings is None else settings
    groups, alpha = settings.groups, settings.alpha
    counted, left_out = counted_touches(touches, participants, groups, settings.protocol, settings.unit)
    people = people_of(counted, groups)
    findings = StudyFindings(
        groups=groups,
        protocol=settings.protocol,
        unit=settings.unit,
        people=people,
        left_out=left_out,
        spread={group: spread_of(counted, group) for group in groups},
        primary=_nothing_to_test(groups),
        effect=Effect("ratio of geometric means", None, "-", None, "One of the groups has no participant."),
        other_tests=(),
        other_effects=(),
        mixed=None,
        bayes=None,
        limits=(),
        methods=methods(settings),
    )
    first, second = (logs_of(people, group) for group in groups)
    if min(len(first), len(second)) == 0:
        return findings
    logs = np.concatenate([first, second])
    ways = relabellings(len(first), len(second), np.random.default_rng(settings.seed))
    primary = permutation_test(logs, ways, alpha)
    others = (rank_test(logs, ways, alpha), welch_test(first, second, alpha))
    return replace(
        findings,
        primary=primary,
        effect=ratio_effect(first, second, groups),
        other_tests=tuple(test for test in others if test is not None),
        other_effects=_other_effects(people, groups, ways, settings.unit),
        mixed=mixed_fit(counted, groups) if settings.mixed else None,
        bayes=_bayes(counted, groups) if settings.bayes else None,
        limits=limits(first, second, len(counted), alpha, primary.p_min or 0.0),
    )


def _nothing_to_test(groups: tuple[str, str]) -> Test:
    sentence = f"No participant of '{groups[0]}' or none of '{groups[1]}' has accepted touches: no test is possible."
    return Test(EXACT, None, None, None, sentence, "no p", sentence)


def _other_effects(
    people: tuple[ParticipantValue, ...], groups: tuple[str, str], ways: Relabellings, unit: Unit
) -> tuple[Effect, ...]:
    first, second = (logs_of(people, group) for group in groups)
    logs, deviations = np.concatenate([first, second]), np.array([person.median for person in people])
    level = reachable_level(ways, 0.95)
    shift = shift_interval(logs, ways, level)
    ratio = Interval(_exp(shift.low), _exp(shift.high), level, shift.method)
    difference, pairs = pair_interval(deviations, ways, level)
    by_pairs = f"Hodges-Lehmann: median over all pairs of one person of {groups[0]} and one of {groups[1]}."
    note = "" if level >= 0.95 else f" With so few people no interval above a level of {100 * level:.3g} % is bounded."
    effects = (
        Effect(
            "ratio, exact interval",
            exp(float(first.mean() - second.mean())),
            "-",
            ratio,
            f"No assumption of normality.{note}",
        ),
        Effect("difference of medians", difference, unit, pairs, by_pairs + note),
        hedges_g(first, second),
    )
    return tuple(effect for effect in effects if effect is not None)


def _exp(value: float | None) -> float | None:
    return None if value is None else exp(value)


def _bayes(counted: pd.DataFrame, groups: tuple[str, str]) -> BayesFit:
    return bayes_fit(sums_of(counted, groups), groups, SENSITIVITY)


def methods(settings: CompareSettings) -> tuple[str, ...]:
    """Return the sentences for the methods paragraph."""
    first, second = settings.groups
    return (
        f"Each participant's accepted touches in '{settings.protocol}' (all sessions) were condensed to the median of "
        "the natural logarithm of the deviation; participants, not touches, are the units of every test.",
        f"Primary test: exact two-sided permutation of the difference of means, {first} minus {second}, over all ways "
        f"to assign the participants (twice the smaller tail; up to {COUNTED_MAX:,} ways enumerated, else drawn).",
        "Effect: ratio of geometric means with Welch's 95 % t interval on the logarithms. In addition: the interval "
        "that inverts the exact test, the Hodges-Lehmann difference and Hedges' g.",
        "Secondary: linear mixed model by REML (group, window and both together; participants as random intercepts), "
        "whose Wald p-values are too small with few people; and a hierarchical model by quadrature under five priors.",
        f"alpha = {settings.alpha:g}, two-sided; one primary test, no correction for the secondary ones.",
    )
