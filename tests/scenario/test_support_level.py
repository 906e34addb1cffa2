"""Support test of a weak wearer: carried at first, let down by the guard's ramp, and carried again after sinking."""

import numpy as np
import pytest

from exograv.laboratory.support_level.weak_participant import WeakParticipant, prepare_weak_participant
from exograv.procedures.rehabilitation.support_level.flight import SINK_M, SupportFlight
from exograv.procedures.rehabilitation.support_level.options import SupportOptions
from exograv.safety.guard import GRAVITY_LEVEL_S

pytestmark = pytest.mark.slow

HIGH = (6, 8)
"""Targets with the arm nearly straight: above the shoulder, across, and to the side."""


@pytest.fixture(scope="module")
def weak() -> WeakParticipant:
    return prepare_weak_participant(SupportOptions(seed=1000, strength=0.1), lambda _text, _share: None)


@pytest.fixture(scope="module")
def helpless() -> WeakParticipant:
    return prepare_weak_participant(SupportOptions(seed=1000, strength=0.03), lambda _text, _share: None)


def watched(flight: SupportFlight) -> list[float]:
    """Supports at every evaluation."""
    supports: list[float] = []
    look = flight._look

    def see(t, q):
        look(t, q)
        supports.append(flight.support)

    flight._look = see
    return supports


def test_fully_carried_the_weak_reach_high_targets_and_alone_they_do_not(weak: WeakParticipant):
    flight = weak.flight(1000)
    assert [flight.attempt(k, 1.0).reached for k in HIGH] == [True, True]
    assert [flight.attempt(k, 0.0).reached for k in HIGH] == [False, False]
    flight.carry_all()
    assert flight.support == 1.0


def test_support_changes_by_the_guards_ramp_and_an_arm_that_sinks_is_carried_again(helpless: WeakParticipant):
    flight = helpless.flight(1001)
    supports = watched(flight)
    tried = flight.attempt(5, 0.0)
    steps = np.diff(supports)
    assert np.abs(steps).max() <= 0.02 / GRAVITY_LEVEL_S + 1e-6  # One evaluation every 20 ms.
    assert tried.rescued
    assert not tried.reached
    assert flight._rest_tip is not None
    assert flight._tip[2] > flight._rest_tip[2] - 3.0 * SINK_M


def test_the_same_seeds_give_the_same_attempts(weak: WeakParticipant):
    first, second = (weak.flight(1002).attempt(4, 0.7) for _ in range(2))
    assert first == second
