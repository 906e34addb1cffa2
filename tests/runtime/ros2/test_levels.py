"""A gravity level from outside is passed on only if it is allowed, valid, not too frequent, and before any stop."""

import math

import pytest

from exograv.runtime.ros2.levels import EVERY_S, Levels
from exograv.safety.guard import SafeState


@pytest.mark.parametrize("level", [0.0, 0.165, 1.0])
def test_a_level_is_passed_on(level: float):
    levels = Levels(accepts=True)
    assert levels.ask(level, 5.0) == ""
    assert levels.accepted == [(5.0, level)]


@pytest.mark.parametrize("level", [math.nan, math.inf, -math.inf, -0.001, 1.001, 1.8])
def test_an_invalid_level_is_refused_with_the_allowed_range(level: float):
    levels = Levels(accepts=True)
    assert "0 (weightless) to 1 (Earth)" in levels.ask(level, 5.0)
    assert levels.accepted == []
    assert levels.refused.total() == 1


def test_no_level_is_passed_on_if_the_run_was_not_started_for_it():
    assert "--ros2-accept-gravity-level" in Levels(accepts=False).ask(0.5, 5.0)


def test_levels_have_a_rate_limit_and_a_refused_one_does_not_delay_the_next():
    levels = Levels(accepts=True)
    asked = [levels.ask(0.01 * k, 0.1 * k) for k in range(31)]
    assert [t for t, _ in levels.accepted] == pytest.approx([0.0, EVERY_S, 2 * EVERY_S, 3 * EVERY_S])
    assert "less than 1 s ago" in asked[1]


@pytest.mark.parametrize("state", [SafeState.DESCENT, SafeState.DAMPING, SafeState.ISOLATION])
def test_after_a_stop_no_level_is_passed_on_even_if_the_latch_was_reset(state: SafeState):
    levels = Levels(accepts=True)
    levels.look(SafeState.BRIDGE)
    assert levels.ask(0.2, 1.0) == ""
    levels.look(state)
    levels.look(SafeState.NONE)
    assert "stopped" in levels.ask(0.3, 100.0)
