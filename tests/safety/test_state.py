"""A guard that gets the state of another one goes on as that one does."""

import numpy as np
import pytest

from exograv.errors import ConfigError
from exograv.safety.envelope import Envelope
from exograv.safety.guard import Guard, SafeState
from exograv.safety.limits import Limits
from exograv.safety.native import core
from exograv.safety.native.library import LIBRARY
from exograv.safety.state import is_state, most_numbers, put_state, state_places

from .random_machines import draw_history, draw_machines, first_guard, first_step

MACHINES, TICKS, AFTER = 12, 600, (1, 40, 333)


@pytest.mark.parametrize("joints", [pytest.param(2, marks=pytest.mark.long), 4])
def test_with_the_state_of_another_guard_a_guard_goes_on_to_the_last_bit(joints: int):
    rng = np.random.default_rng(joints)
    machines = draw_machines(rng, MACHINES, joints)
    with np.errstate(all="ignore"):
        history, stops = draw_history(rng, machines, TICKS), 0
        for b in range(MACHINES):
            one, _ = first_guard(machines, b)
            other, record = None, one.envelope.record
            for k in range(TICKS):
                ours = first_step(one, history, k, b)[0]
                if other is not None:
                    theirs = first_step(other, history, k, b)[0]
                    assert ours.tau.tobytes() == theirs.tau.tobytes(), (b, k)
                    assert ours.safe_state == theirs.safe_state
                    assert is_state(other.envelope.record, record.view[state_places(record)]), (b, k)
                if k in AFTER:
                    # The source goes on where the compiled guard was, and the other way round.
                    other, _ = first_guard(machines, b, LIBRARY if k == AFTER[1] else None)
                    put_state(other.envelope.record, record.view[state_places(record)])
            stops += one.envelope.stop is not None
    assert stops > 3  # faults were among what both went through


def test_every_number_of_a_state_counts():
    machines = draw_machines(np.random.default_rng(1), 1, 4)
    record = first_guard(machines, 0)[0].envelope.record
    state = record.view[state_places(record)].copy()
    assert is_state(record, state)
    for place in range(len(state)):
        changed = state.copy()
        changed[place] = 7.25 if state[place] != 7.25 else 1.0
        assert not is_state(record, changed), place


def test_the_state_of_a_machine_with_other_joints_is_refused():
    two, four = (first_guard(draw_machines(np.random.default_rng(1), 1, joints), 0)[0] for joints in (2, 4))
    state = two.envelope.record.view[state_places(two.envelope.record)]
    assert not is_state(four.envelope.record, state)
    with pytest.raises(ConfigError, match="same joints"):
        put_state(four.envelope.record, state)


@pytest.mark.parametrize("period_s", [2.5e-4, 1e-3, 4e-3])
@pytest.mark.parametrize("joints", [1, 4, core.JOINTS])
def test_no_state_is_larger_than_its_place_in_the_ring(joints: int, period_s: float):
    envelope = Envelope(Limits(np.ones(joints), np.ones(joints)), period_s)
    record = Guard.of_machine(envelope, period_s).envelope.record
    assert len(state_places(record)) <= most_numbers(joints)
    if period_s == 2.5e-4:
        assert most_numbers(joints) <= 1.2 * len(state_places(record))


@pytest.mark.parametrize("wrong", [-1.0, 0.5, 1e6, np.nan, np.inf])
@pytest.mark.parametrize("name", ["N", "DT", "USED_AT", "TOLD_AT", "TOLD_COUNT", "BEFORE_AT", "STOP", "SAFE_STATE"])
def test_a_state_that_no_guard_has_is_refused_and_changes_nothing(name: str, wrong: float):
    record = first_guard(draw_machines(np.random.default_rng(1), 1, 4), 0)[0].envelope.record
    before, places = record.view.copy(), state_places(record)
    state = before[places]
    put_state(record, state)
    state[np.flatnonzero(places == getattr(core, name))] = wrong if name != "SAFE_STATE" or wrong != -1.0 else 4.0
    with pytest.raises(ConfigError, match="other settings, or damaged"):
        put_state(record, state)
    np.testing.assert_array_equal(record.view, before)


@pytest.mark.parametrize(
    ("place", "most"),
    [
        (core.USED_AT, 25),
        (core.TOLD_AT, 29),
        (core.BEFORE_AT, 8),
        (core.TOLD_COUNT, core.SLOTS),
        (core.BEFORE_COUNT, core.SLOTS),
        (core.STOP, 16),
        (core.MACHINE_MISSES + 1, 10),
        (core.CONTROL_MISSES + 1, 10),
    ],
)
def test_an_index_is_accepted_up_to_the_last_place_and_no_farther(place: int, most: int):
    limits = Limits(np.full(2, 60.0), np.full(2, 4.0))
    record = Guard.of_machine(Envelope(limits, 1e-3), 1e-3).envelope.record
    places = state_places(record)
    for value, is_possible in ((0, True), (most, True), (most + 1, False), (-1, False)):
        state = record.view[places].copy()
        state[np.flatnonzero(places == place)] = value
        if is_possible:
            put_state(record, state)
            assert record.numbers[place] == value
        else:
            with pytest.raises(ConfigError, match="other settings, or damaged"):
                put_state(record, state)


@pytest.mark.parametrize("number", [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0])
def test_each_safe_state_is_accepted_and_no_other_one(number: float):
    limits = Limits(np.full(2, 60.0), np.full(2, 4.0))
    record = Guard.of_machine(Envelope(limits, 1e-3), 1e-3).envelope.record
    places = state_places(record)
    state = record.view[places].copy()
    state[np.flatnonzero(places == core.SAFE_STATE)] = number
    if number in {one.value for one in SafeState}:
        put_state(record, state)
        assert is_state(record, state)
    else:
        with pytest.raises(ConfigError):
            put_state(record, state)


def test_the_state_is_all_but_the_inputs_of_a_tick_and_the_places_that_no_ring_uses():
    limits = Limits(np.full(2, 60.0), np.full(2, 4.0))
    record = Guard.of_machine(Envelope(limits, 1e-3), 1e-3).envelope.record
    starts = [core.Q_IN, core.CURRENT_IN, core.TAU_IN, core.Q_MOTOR_IN, core.FAULTY_IN, core.ANSWER_IN]
    inputs = [*range(core.CAME, core.VALID_UNTIL + 1), *(start + j for start in starts for j in range(2))]
    rings = ((core.USED, 26), (core.TOLD, 30), (core.BEFORE, 9), (core.MOTOR_BEFORE, 9))
    beyond = [ring + slots * core.JOINTS + j for ring, slots in rings for j in range(2)]
    within = [ring + slot * core.JOINTS + j for ring, slots in rings for slot in range(slots) for j in range(2)]
    state = record.view[state_places(record)].copy()
    for places, counts in (([*inputs, *beyond], False), ([core.STOP, core.CONTROL_MISSES, *within], True)):
        for place in places:
            before = record.numbers[place]
            record.numbers[place] = 7.25
            assert is_state(record, state) != counts, place
            record.numbers[place] = before
