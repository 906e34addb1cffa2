"""Known answer by brute force: correct for persons of known thresholds, with an interval, in few attempts."""

import numpy as np
import pytest

from exograv.procedures.rehabilitation.support_level.search import SUPPORTS
from exograv.procedures.rehabilitation.support_level.targets import TARGETS
from known_support_level import FlownAnswer, crossing, fly_answer, rising_share

from .persons import Known

HELD_LEAST = 35
"""Least number of 40 intervals of 95 % that contain the truth. Fewer happen by chance in one run of a hundred."""

OFF_MOST = 0.015
"""Largest mean error over those persons [share of the weight]; the error of one person has an SD of 0.025."""


def flown(person: Known, repeats: int = 1) -> FlownAnswer:
    return fly_answer(person, len(TARGETS), repeats, lambda _text, _share: None)


def test_the_known_answer_lies_between_two_supports_that_were_flown():
    supports = np.array([0.4, 0.5, 0.6])
    assert crossing(supports, np.array([0.5, 0.7, 0.9])) == pytest.approx(0.55)
    assert crossing(supports, np.array([0.5, 0.6, 0.7])) is None
    assert crossing(supports, np.array([0.9, 0.9, 0.9])) == 0.4


def test_a_share_that_falls_is_pooled_by_how_often_it_was_tried():
    at = np.arange(4)
    tries, hits = np.zeros((2, len(SUPPORTS), 1), dtype=int)
    tries[at, 0], hits[at, 0] = [5, 15, 5, 5], [0, 9, 2, 5]
    np.testing.assert_allclose(rising_share(hits, tries)[at, 0], [0.0, 0.55, 0.55, 1.0])
    tries[at, 0], hits[at, 0] = [5, 5, 5, 5], [0, 3, 2, 5]
    np.testing.assert_allclose(rising_share(hits, tries)[at, 0], [0.0, 0.5, 0.5, 1.0])


@pytest.mark.slow
def test_brute_force_holds_the_truth_of_persons_whom_it_does_not_model():
    held, off, attempts = [], [], []
    for seed in range(1000, 1040):
        person = Known(seed)
        answer = flown(person)
        low, high = answer.interval()
        value, true = answer.needed(), min(max(person.needed(), 0.0), 1.0)
        held.append(low - 1e-3 <= true <= high + 1e-3)
        off.append((1.0 if value is None else value) - true)
        attempts.append(len(person.asked))
    assert sum(held) >= HELD_LEAST
    assert abs(np.mean(off)) < OFF_MOST
    assert np.mean(attempts) < 100


def test_whom_nothing_helps_and_who_needs_nothing_are_found_out():
    assert flown(Known(1000, person=1.6)).needed() is None
    assert flown(Known(1000, person=-0.6)).needed() == 0.0


def test_no_target_is_tried_oftener_than_asked_for():
    assert flown(Known(1001), repeats=2).tries.max() == 2
