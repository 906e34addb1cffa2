"""Search of the support level: correct for persons of known thresholds, with an interval, in small steps."""

import itertools

import numpy as np
import pytest

from exograv.procedures.rehabilitation.support_level.search import (
    ATTEMPTS_MAX,
    STEP_DOWN_MAX,
    WIDTH_ENOUGH,
    NeededSupport,
    search,
)
from exograv.procedures.rehabilitation.support_level.threshold import ThresholdSearch, needed_support

from .persons import Known

COVERAGE_LEAST = 0.88
"""Least coverage of 95 % intervals over 40 persons. Less happens by chance in one run of a hundred."""

QUICKLY = 0.3
"""Width of the interval [share of the weight] for laws that hold after any number of attempts."""


def found(person: Known, seed: int = 1, width: float = WIDTH_ENOUGH) -> NeededSupport:
    return search(person, seed, lambda _text, _share: None, width)


def test_support_comes_down_from_full_and_never_farther_than_a_step_below_what_has_succeeded():
    person, least = Known(1000), 1.0
    found(person, width=QUICKLY)
    assert person.asked[0][0] >= 1.0 - STEP_DOWN_MAX - 1e-9
    for support, hit in person.asked:
        assert support >= least - STEP_DOWN_MAX - 1e-9
        least = min(least, support) if hit else least


def test_the_same_attempts_give_the_same_answer():
    first, second = (found(Known(1000), width=QUICKLY) for _ in range(2))
    assert first.ci == second.ci


def test_who_needs_nothing_is_found_to_need_nothing():
    middle, low, high = found(Known(1000, person=-0.6)).ci
    assert middle == low == 0.0
    assert high < 0.1


def test_whom_full_support_does_not_help_is_found_out():
    needed = found(Known(1000, person=1.6))
    assert needed.beyond > 0.9
    assert needed.ci[2] == 1.0


def test_more_successes_never_ask_for_more_support():
    answers = []
    for hits in range(0, 13, 3):
        one = ThresholdSearch(12, 0.8, 0)
        for target in range(12):
            one.take(target, 0.5, target < hits)
        answers.append(one.posterior(2000).interval()[0])
    assert all(later <= earlier + 0.01 for earlier, later in itertools.pairwise(answers))


def test_needed_support_is_where_the_mean_chance_meets_the_criterion():
    thresholds = np.full((1, 12), 0.4)
    value = needed_support(thresholds, np.array([0.02]), 0.5)
    assert value[0] == pytest.approx(0.4, abs=1e-3)


@pytest.mark.slow
def test_stated_intervals_hold_what_is_true():
    people = [Known(seed) for seed in range(1000, 1040)]
    needed = [found(person, seed) for seed, person in enumerate(people)]
    held = []
    for person, one in zip(people, needed, strict=True):
        true = min(max(person.needed(), 0.0), 1.0)
        held.append(one.ci[1] - 1e-3 <= true <= one.ci[2] + 1e-3)
        assert one.attempts <= ATTEMPTS_MAX
    assert np.mean(held) >= COVERAGE_LEAST
