"""The search finds what virtual persons of known thresholds need, says how sure it is, and never lowers in leaps."""

import itertools

import numpy as np
import pytest

from exograv.session.support_level.known_answer import crossing, isotonic
from exograv.session.support_level.search import ATTEMPTS_MAX, STEP_DOWN_MAX, Needed, search
from exograv.session.support_level.targets import TARGETS
from exograv.session.support_level.threshold import ThresholdSearch, needed_support

COVERAGE_LEAST = 0.88
"""Of a 95 % interval over 40 persons: fewer would come by chance in one run of a hundred."""


class Known:
    """Reaches a target with a chance that rises with support."""

    def __init__(self, seed: int, person: float | None = None):
        self.random = np.random.default_rng(seed)
        middle = self.random.uniform(0.1, 0.9) if person is None else person
        self.thresholds = middle + self.random.uniform(0.04, 0.25) * self.random.standard_normal(len(TARGETS))
        self.width = self.random.uniform(0.008, 0.06)
        self.asked: list[tuple[float, bool]] = []

    def chance(self, s: np.ndarray) -> np.ndarray:
        return 0.02 + 0.96 / (1.0 + np.exp(-np.clip((s - self.thresholds) / self.width, -50, 50)))

    def __call__(self, target: int, support: float) -> bool:
        hit = bool(self.random.random() < self.chance(np.array(support))[target])
        self.asked.append((support, hit))
        return hit

    def needed(self) -> float:
        grid = np.linspace(-0.5, 1.5, 2001)
        return float(grid[np.argmax(self.chance(grid[:, None]).mean(axis=1) >= 0.8)])


def found(person: Known, seed: int = 1) -> Needed:
    return search(person, seed, lambda _text, _share: None)


def test_support_comes_down_from_full_and_never_farther_than_a_step_below_what_has_succeeded():
    for seed in range(1000, 1002):
        person = Known(seed)
        found(person)
        least = 1.0
        assert person.asked[0][0] >= 1.0 - STEP_DOWN_MAX - 1e-9
        for support, hit in person.asked:
            assert support >= least - STEP_DOWN_MAX - 1e-9
            least = min(least, support) if hit else least


def test_the_same_attempts_give_the_same_answer():
    assert found(Known(1000)).ci == found(Known(1000)).ci


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


def test_the_known_answer_never_falls_with_support_and_lies_between_two_that_were_flown():
    np.testing.assert_allclose(isotonic(np.array([0.0, 0.6, 0.4, 1.0])), [0.0, 0.5, 0.5, 1.0])
    supports = np.array([0.4, 0.5, 0.6])
    assert crossing(supports, np.array([0.5, 0.7, 0.9])) == pytest.approx(0.55)
    assert crossing(supports, np.array([0.5, 0.6, 0.7])) is None
    assert crossing(supports, np.array([0.9, 0.9, 0.9])) == 0.4


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
