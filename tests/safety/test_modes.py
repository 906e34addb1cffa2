"""A worn machine changes its mode only by the table: no short cut into an arm, none out of a fault."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from exograv.safety.modes import (
    DRIFT_MAX_RAD,
    RAMP_IN_S,
    RAMP_OUT_S,
    SPEED_MAX_RAD_S,
    TRANSITIONS,
    WORN,
    Event,
    Mode,
    ModeMachine,
)

DT = 1e-3
WRITTEN_DOWN = """
           TEST      PASSED   FAILED TAKE_ARM ARRIVED  MOVE   WEIGH    FLOAT    GIVE_BACK SWITCH_OFF FAULT RESET
OFF        SELF_TEST -        -      -        -        -      -        -        -         -          -     -
SELF_TEST  -         EXO_ONLY OFF    -        -        -      -        -        -         OFF        SAFE  -
EXO_ONLY   -         -        -      RAMP_IN  -        -      -        -        -         OFF        SAFE  -
RAMP_IN    -         -        -      -        FLOATING -      -        -        RAMP_OUT  -          SAFE  -
FLOATING   -         -        -      -        -        MOVING WEIGHING -        RAMP_OUT  -          SAFE  -
MOVING     -         -        -      -        -        -      WEIGHING FLOATING RAMP_OUT  -          SAFE  -
WEIGHING   -         -        -      -        -        MOVING -        FLOATING RAMP_OUT  -          SAFE  -
RAMP_OUT   -         -        -      -        EXO_ONLY -      -        -        -         -          SAFE  -
SAFE       -         -        -      -        -        -      -        -        -         -          -     OFF
"""
"""All transitions and all refusals, written a second time: one row per mode, one column per event."""

INTO_AN_ARM = (Event.TEST, Event.PASSED, Event.TAKE_ARM)
STEEPEST_PER_S = 0.32  # pi / (2 * 5 s), in shares of the arm


def after(*events: Event) -> ModeMachine:
    machine = ModeMachine()
    for event in events:
        assert machine.take(event), event
    return machine


def ramped(machine: ModeMachine, seconds: float, drift: float = 0.0, fastest: float = 0.0) -> list[float]:
    shares = []
    for _ in range(round(seconds / DT) + 1):
        machine.step(DT, drift, fastest)
        shares.append(machine.arm_share)
    return shares


@pytest.mark.parametrize(("mode", "event"), list(itertools.product(Mode, Event)))
def test_an_event_has_exactly_the_effect_in_the_table(mode: Mode, event: Event):
    machine = ModeMachine(mode, 0.25 if mode in WORN else 0.0)
    before = (machine.mode, machine.arm_share)
    expected = TRANSITIONS.get((mode, event))
    assert machine.take(event) == (expected is not None)
    assert machine.mode is (expected or mode)
    if expected is None:
        assert (machine.mode, machine.arm_share) == before


def written_down() -> dict[tuple[Mode, Event], Mode | None]:
    head, *rows = [line.split() for line in WRITTEN_DOWN.strip().splitlines()]
    return {
        (Mode[mode], Event[event]): None if after == "-" else Mode[after]
        for mode, *afters in rows
        for event, after in zip(head, afters, strict=True)
    }


@pytest.mark.parametrize(("mode", "event"), list(itertools.product(Mode, Event)))
def test_every_transition_and_every_refusal_is_as_written_here(mode: Mode, event: Event):
    machine = ModeMachine(mode, 0.25 if mode in WORN else 0.0)
    expected = written_down()[mode, event]
    assert machine.take(event) == (expected is not None)
    assert machine.mode is (expected or mode)


def test_every_mode_can_be_reached_and_left():
    assert set(TRANSITIONS.values()) == set(Mode)
    assert {mode for mode, _ in TRANSITIONS} == set(Mode)


def test_nobody_gets_into_a_machine_that_has_not_passed_its_self_test():
    for (mode, event), to in TRANSITIONS.items():
        if to is Mode.EXO_ONLY:
            assert (mode, event) in ((Mode.SELF_TEST, Event.PASSED), (Mode.RAMP_OUT, Event.ARRIVED))
        if to in WORN and mode not in WORN:
            assert (mode, event, to) == (Mode.EXO_ONLY, Event.TAKE_ARM, Mode.RAMP_IN)


@pytest.mark.parametrize("mode", [mode for mode in Mode if mode in WORN])
def test_a_worn_machine_is_not_switched_off_and_a_fault_in_it_leads_to_safety(mode: Mode):
    assert (mode, Event.SWITCH_OFF) not in TRANSITIONS
    assert TRANSITIONS[mode, Event.FAULT] is Mode.SAFE


def test_safety_is_left_by_a_reset_only_and_the_reset_starts_nothing():
    assert [(event, to) for (mode, event), to in TRANSITIONS.items() if mode is Mode.SAFE] == [(Event.RESET, Mode.OFF)]


def test_the_arm_s_share_comes_without_a_step_and_ends_whole():
    machine = after(*INTO_AN_ARM)
    shares = ramped(machine, RAMP_IN_S)
    assert machine.mode is Mode.FLOATING
    assert shares[-1] == 1.0
    rate = np.diff([0.0, *shares]) / DT
    assert (rate >= 0.0).all()
    assert rate.max() < STEEPEST_PER_S


@pytest.mark.parametrize(
    ("drift", "fastest", "goes_on"),
    [
        (DRIFT_MAX_RAD, SPEED_MAX_RAD_S, True),
        (1.01 * DRIFT_MAX_RAD, 0.0, False),
        (0.0, 1.01 * SPEED_MAX_RAD_S, False),
        (float("nan"), 0.0, False),
        (0.0, float("nan"), False),
    ],
)
def test_an_arm_that_moves_while_it_is_taken_is_given_back(drift: float, fastest: float, goes_on: bool):
    machine = after(*INTO_AN_ARM)
    ramped(machine, 1.0)
    machine.step(DT, drift, fastest)
    assert machine.mode is (Mode.RAMP_IN if goes_on else Mode.RAMP_OUT)


@given(st.floats(0.0, RAMP_IN_S))
@settings(max_examples=15)
def test_given_back_half_way_the_share_goes_down_from_where_it_was(seconds: float):
    machine = after(*INTO_AN_ARM)
    ramped(machine, 0.2 * seconds)
    share = machine.arm_share
    if machine.mode is Mode.RAMP_IN:
        machine.take(Event.GIVE_BACK)
        shares = ramped(machine, RAMP_OUT_S)
        assert (np.diff([share, *shares]) <= 0.0).all()
        assert machine.mode is Mode.EXO_ONLY
        assert machine.arm_share == 0.0


def test_between_floating_moving_and_weighing_the_whole_arm_stays_carried():
    machine = after(*INTO_AN_ARM)
    ramped(machine, RAMP_IN_S)
    for event in (Event.MOVE, Event.WEIGH, Event.FLOAT, Event.WEIGH, Event.MOVE, Event.FLOAT):
        assert machine.take(event)
        machine.step(DT, 1.0, 4.0)
        assert machine.arm_share == 1.0


@pytest.mark.parametrize("event", [Event.FLOAT, Event.MOVE, Event.WEIGH])
def test_no_mode_is_entered_before_the_arm_is_carried(event: Event):
    for events in ((), (Event.TEST,), (Event.TEST, Event.PASSED), INTO_AN_ARM):
        assert not after(*events).take(event)


def test_a_ramp_ends_with_its_time_and_not_a_tick_before():
    dt = 2.0**-8  # without rounding
    machine = after(*INTO_AN_ARM)
    for seconds, before, then in (
        (RAMP_IN_S, Mode.RAMP_IN, Mode.FLOATING),
        (RAMP_OUT_S, Mode.RAMP_OUT, Mode.EXO_ONLY),
    ):
        for _ in range(round(seconds / dt) - 1):
            machine.step(dt, 0.0, 0.0)
        assert machine.mode is before
        machine.step(dt, 0.0, 0.0)
        assert machine.mode is then
        machine.take(Event.GIVE_BACK)


def test_the_share_goes_along_a_line_and_is_a_half_in_the_middle_of_either_ramp():
    machine = after(*INTO_AN_ARM)
    assert ramped(machine, 0.5 * RAMP_IN_S)[-1] == pytest.approx(0.5, abs=1e-3)
    ramped(machine, 0.5 * RAMP_IN_S)
    assert machine.take(Event.GIVE_BACK)
    shares = ramped(machine, 0.5 * RAMP_OUT_S)
    np.testing.assert_allclose(np.diff(shares), -DT / RAMP_OUT_S, atol=1e-12)
    assert shares[-1] == pytest.approx(0.5, abs=1e-3)
    machine.take(Event.FAULT)
    assert machine.arm_share == 0.0


def test_a_machine_that_begins_in_a_ramp_begins_it_without_the_arm():
    coming, going = ModeMachine(Mode.RAMP_IN), ModeMachine(Mode.RAMP_OUT)
    assert max(ramped(coming, 0.1)) < 0.01
    assert not any(ramped(going, 0.1))


def test_the_sentence_of_a_mode_is_its_value_and_has_translations():
    for mode in Mode:
        assert mode.sentence == mode.value
        assert mode.sentence.code == f"mode.{mode.name.lower()}"


def test_nothing_is_carried_before_a_ramp_and_a_late_tick_ends_one_exactly():
    machine = ModeMachine()
    assert machine.arm_share == 0.0
    for event in INTO_AN_ARM:
        machine.take(event)
    while machine.mode is Mode.RAMP_IN:
        machine.step(0.7, 0.0, 0.0)
    assert machine.arm_share == 1.0
    machine.take(Event.GIVE_BACK)
    while machine.mode is Mode.RAMP_OUT:
        assert 0.0 < machine.arm_share <= 1.0
        machine.step(0.7, 0.0, 0.0)
    assert machine.arm_share == 0.0
