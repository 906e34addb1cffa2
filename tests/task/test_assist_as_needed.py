"""Support adapts to the reached targets within its limits, never decreases after a failure, and does not oscillate."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.errors import ConfigError
from exograv.task.assist_as_needed import SENTENCES, AssistSettings, AssistState, decide, first_session, next_session

USUAL = AssistSettings()
ALL, NONE = [True] * 12, [False] * 12

shares = st.lists(st.tuples(st.integers(0, 12), st.booleans()), max_size=40)
settings = st.builds(
    lambda least, wide, down, more, session, begin: AssistSettings(
        least, least + wide, down, down + more, session, begin
    ),
    *(st.floats(0.0, 40.0), st.floats(1.0, 60.0), st.floats(0.5, 20.0), st.floats(0.0, 20.0)),
    *(st.floats(1.0, 50.0), st.floats(0.0, 20.0)),
)


def block(hits: int) -> list[bool]:
    return [k < hits for k in range(12)]


def session(chosen: AssistSettings, state: AssistState, blocks: list[tuple[int, bool]]) -> list[AssistState]:
    states = [state]
    for hits, sank in blocks:
        states.append(decide(chosen, states[-1], block(hits), sank).state)
    return states


@given(chosen=settings, blocks=shares)
def test_support_never_leaves_its_bounds_nor_falls_by_more_than_a_session_may_take(chosen, blocks):
    states = session(chosen, first_session(chosen, 50.0), blocks)
    for before, after in itertools.pairwise(states):
        assert chosen.least_percent <= after.support_percent <= chosen.most_percent
        assert -chosen.step_down_percent <= after.support_percent - before.support_percent + 1e-9
        assert after.support_percent - before.support_percent <= chosen.step_up_percent + 1e-9
        assert after.support_percent >= states[0].support_percent - chosen.session_percent - 1e-9


@given(chosen=settings, blocks=shares)
def test_within_a_session_support_turns_at_most_once(chosen, blocks):
    steps = np.diff([state.support_percent for state in session(chosen, first_session(chosen), blocks)])
    signs = [s for s in np.sign(steps).tolist() if s]
    assert signs == sorted(signs)


@given(hits=st.integers(0, 12), sank=st.booleans(), at=st.floats(0.0, 100.0), failed=st.booleans())
def test_support_never_comes_down_after_a_block_that_failed(hits: int, sank: bool, at: float, failed: bool):
    decision = decide(USUAL, AssistState(at, 100.0, failed), block(hits), sank)
    if sank or failed or hits < 0.85 * 12:
        assert decision.state.support_percent >= at
    assert decision.state.has_failed == (failed or sank or hits < 0.6 * 12)


@given(hits=st.integers(0, 12), more=st.integers(0, 12), at=st.floats(0.0, 100.0))
def test_who_reaches_more_is_never_given_more_support(hits: int, more: int, at: float):
    few, many = sorted((hits, more))
    state = AssistState(at, 100.0)
    less, greater = (decide(USUAL, state, block(n)).state.support_percent for n in (many, few))
    assert less <= greater


@pytest.mark.parametrize("needed", [0.0, 18.0, 43.0, 77.0])
def test_support_comes_to_what_a_person_needs_and_follows_as_they_get_stronger(needed: float):
    random, state, ends = np.random.default_rng(1000), first_session(USUAL), []
    for number in range(24):
        now = needed if number < 14 else max(needed - 15.0, 0.0)
        for _ in range(6):
            p = 0.97 / (1.0 + math.exp(-(state.support_percent - now + 5.0) / 3.0))
            state = decide(USUAL, state, (random.random(12) < p).tolist()).state
        ends.append(state.support_percent)
        state = next_session(USUAL, state).state
    # Support settles just above the need: a step up, and the higher start of a session, keep it there.
    room = USUAL.step_up_percent + USUAL.begin_percent
    assert all(needed - 7.5 <= end <= needed + room for end in ends[9:14])
    assert all(max(needed - 15.0, 0.0) - 7.5 <= end <= max(needed - 15.0, 0.0) + room for end in ends[-4:])


def test_nobody_who_fails_everything_is_left_without_full_support():
    state = first_session(USUAL, 20.0)
    for _ in range(10):
        state = decide(USUAL, state, NONE).state
    assert state.support_percent == USUAL.most_percent


def test_every_decision_says_why_with_its_own_numbers():
    down = decide(USUAL, AssistState(60.0, 60.0), ALL)
    assert down.text == "12 of 12 targets reached: support goes down from 60 to 55 %."
    codes = {
        down.code,
        decide(USUAL, AssistState(60.0, 60.0), block(8)).code,
        decide(USUAL, AssistState(0.0, 10.0), ALL).code,
        decide(USUAL, AssistState(40.0, 60.0), ALL).code,
        decide(USUAL, AssistState(60.0, 60.0, has_failed=True), ALL).code,
        decide(USUAL, AssistState(60.0, 60.0), NONE).code,
        decide(USUAL, AssistState(60.0, 60.0), [True], sank=True).code,
        decide(USUAL, AssistState(100.0, 100.0), NONE).code,
        next_session(USUAL, AssistState(60.0, 60.0)).code,
    }
    assert codes == set(SENTENCES)


def test_a_first_session_begins_fully_supported_where_nothing_is_known():
    assert first_session(USUAL).support_percent == 100.0
    assert first_session(USUAL, 30.0).support_percent == 35.0


def test_a_block_that_is_too_short_decides_nothing():
    with pytest.raises(ConfigError, match="block of 3 attempts; 12 are needed"):
        decide(USUAL, first_session(USUAL), [True] * 3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"least_percent": 50.0, "most_percent": 40.0}, "least_percent is 50"),
        ({"step_down_percent": 0.0}, "step_down_percent is 0"),
        ({"step_up_percent": 2.0}, "step_up_percent is 2, less than"),
        ({"begin_percent": -1.0}, "begin_percent is -1"),
        ({"block": 2}, "block is 2"),
        ({"raise_share": 0.9}, "raise_share is 0.9"),
    ],
)
def test_settings_that_would_swing_or_mean_nothing_are_refused(change: dict, message: str):
    with pytest.raises(ConfigError, match=message):
        replace(USUAL, **change)
