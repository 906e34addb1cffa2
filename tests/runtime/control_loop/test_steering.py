"""No request without a lease, no arm without two steps, and an arm that no page steers is given back."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from exograv.runtime.control_loop.steering import (
    ASKABLE,
    LEASE_MAX_NS,
    READY_NS,
    WINDOW_MAX_NS,
    CommandDecisions,
    LeaseCommand,
)
from exograv.safety.modes import TRANSITIONS, WORN, Event, Mode

SECOND = 1_000_000_000
FAR = 10**18


def steered(now_ns: int = 0, **leased) -> CommandDecisions:
    steering = CommandDecisions()
    steering.lease(LeaseCommand(FAR, **leased), now_ns)
    return steering


def ask(steering: CommandDecisions, event: Event, mode: Mode, now_ns: int = 0, is_latched: bool = False) -> str:
    return steering.ask(event, mode, is_latched=is_latched, now_ns=now_ns)


def test_without_a_lease_nothing_may_be_asked_for():
    for mode, event in TRANSITIONS:
        assert "No operator steers" in ask(CommandDecisions(), event, mode)


def test_a_lease_is_never_longer_than_allowed():
    steering = steered()
    assert not ask(steering, Event.TEST, Mode.OFF, LEASE_MAX_NS)
    assert "No operator steers" in ask(steered(), Event.TEST, Mode.OFF, LEASE_MAX_NS + 1)


@pytest.mark.parametrize("event", [event for event in Event if event not in ASKABLE or event is Event.PASSED])
@pytest.mark.parametrize("mode", Mode)
def test_events_that_are_not_the_operator_s_cannot_be_requested(event: Event, mode: Mode):
    assert ask(steered(), event, mode)


@pytest.mark.parametrize("event", ASKABLE)
@pytest.mark.parametrize("mode", Mode)
def test_no_request_is_passed_on_while_the_guard_is_latched(event: Event, mode: Mode):
    steering = steered()
    assert ask(steering, event, mode, is_latched=True)
    assert steering.next() is None


def test_the_self_test_of_the_twin_passes_with_its_request():
    steering = steered()
    assert not ask(steering, Event.TEST, Mode.OFF)
    assert [steering.next(), steering.next(), steering.next()] == [Event.TEST, Event.PASSED, None]


def test_an_arm_is_taken_within_half_a_minute_after_step_one_and_once():
    steering = steered()
    assert "Step one" in ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY)
    ask(steering, Event.TEST, Mode.EXO_ONLY)
    steering.lease(LeaseCommand(FAR), READY_NS)
    assert not ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY, READY_NS)
    assert steering.next() is Event.TAKE_ARM
    assert "Step one" in ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY, READY_NS)
    ask(steering, Event.TEST, Mode.EXO_ONLY, READY_NS)
    steering.lease(LeaseCommand(FAR), 2 * READY_NS + 1)
    assert "Step one" in ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY, 2 * READY_NS + 1)


def test_a_stop_discards_step_one_and_all_waiting_requests():
    steering = steered()
    ask(steering, Event.TEST, Mode.OFF)
    steering.stopped()
    assert steering.next() is None
    assert "Step one" in ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY)


@pytest.mark.parametrize("mode", [mode for mode in Mode if mode in WORN and mode is not Mode.RAMP_OUT])
def test_an_arm_without_a_lease_is_given_back_once(mode: Mode):
    steering = steered()
    assert steering.watch(mode, LEASE_MAX_NS) == ""
    assert steering.watch(mode, LEASE_MAX_NS + 1)
    assert steering.next() is Event.GIVE_BACK
    for now in range(LEASE_MAX_NS + 2, LEASE_MAX_NS + 100):
        assert steering.watch(mode, now) == ""
    assert steering.next() is None


@pytest.mark.parametrize("mode", [mode for mode in Mode if mode not in WORN])
def test_without_a_carried_arm_a_lost_lease_only_discards_step_one(mode: Mode):
    steering = steered()
    ask(steering, Event.TEST, Mode.EXO_ONLY)
    assert steering.watch(mode, LEASE_MAX_NS + 1)
    assert steering.next() is None
    steering.lease(LeaseCommand(FAR), 2 * SECOND)
    assert "Step one" in ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY, 2 * SECOND)


@pytest.mark.parametrize("window_s", [5, 60])
def test_a_window_is_finished_without_an_operator_and_never_longer_than_a_window_takes(window_s: int):
    steering = steered(window_until_ns=window_s * SECOND)
    over = min(window_s * SECOND, LEASE_MAX_NS + WINDOW_MAX_NS)
    assert steering.watch(Mode.FLOATING, LEASE_MAX_NS + 1)
    steering.watch(Mode.FLOATING, over - 1)
    assert steering.next() is None
    steering.watch(Mode.FLOATING, over)
    assert steering.next() is Event.GIVE_BACK
    assert not steering.is_to_stop


def test_a_lost_lease_stops_a_window_if_the_session_is_set_so():
    steering = steered(window_until_ns=5 * SECOND, on_loss="stop")
    assert steering.watch(Mode.FLOATING, LEASE_MAX_NS + 1)
    assert steering.is_to_stop
    assert steering.next() is None


def test_without_a_window_both_settings_give_the_arm_back():
    steering = steered(on_loss="stop")
    steering.watch(Mode.FLOATING, LEASE_MAX_NS + 1)
    assert not steering.is_to_stop
    assert steering.next() is Event.GIVE_BACK


def test_a_renewed_lease_is_valid_and_its_loss_gives_the_arm_back_again():
    steering = steered()
    steering.watch(Mode.FLOATING, LEASE_MAX_NS + 1)
    steering.next()
    again = 10 * SECOND
    steering.lease(LeaseCommand(FAR), again)
    assert steering.watch(Mode.FLOATING, again) == ""
    assert steering.watch(Mode.FLOATING, again + LEASE_MAX_NS + 1)
    assert steering.next() is Event.GIVE_BACK


@given(st.lists(st.tuples(st.sampled_from(Event), st.sampled_from(Mode), st.integers(0, 40)), max_size=30))
def test_no_sequence_of_requests_takes_an_arm_without_making_the_machine_ready_before(words):
    steering, now, ready_at = CommandDecisions(), 0, None
    for event, mode, seconds in words:
        now += seconds * SECOND
        steering.lease(LeaseCommand(FAR), now)
        if not ask(steering, event, mode, now) and event is Event.TEST:
            ready_at = now
        while (told := steering.next()) is not None:
            if told is Event.TAKE_ARM:
                assert ready_at is not None
                assert now - ready_at <= READY_NS
                ready_at = None


@pytest.mark.parametrize("mode", [mode for mode in Mode if (mode, Event.GIVE_BACK) not in TRANSITIONS])
def test_an_arm_that_is_not_carried_is_not_given_back_and_a_carried_one_is_as_soon_as_it_is(mode: Mode):
    steering = steered()
    assert steering.watch(mode, LEASE_MAX_NS + 1)
    assert steering.next() is None
    carried = next(one for one, event in TRANSITIONS if event is Event.GIVE_BACK)
    assert steering.watch(carried, LEASE_MAX_NS + 2) == ""
    assert steering.next() is (Event.GIVE_BACK if carried in WORN else None)


def test_before_the_first_lease_nobody_is_missed():
    steering = CommandDecisions()
    for mode in Mode:
        assert steering.watch(mode, FAR) == ""
    assert steering.next() is None
    assert not steering.is_to_stop


def test_a_window_that_was_over_before_the_lease_was_lost_is_not_stopped():
    steering = steered(window_until_ns=LEASE_MAX_NS - 1, on_loss="stop")
    steering.watch(Mode.FLOATING, LEASE_MAX_NS + 1)
    assert not steering.is_to_stop
    steering = steered(window_until_ns=5 * SECOND, on_loss="stop")
    assert not steering.is_to_stop  # while a page steers


def test_step_one_is_done_again_by_a_test_of_a_ready_machine_and_ends_with_another_event():
    steering = steered()
    assert ask(steering, Event.TEST, Mode.EXO_ONLY) == ""
    assert steering.next() is None  # control has nothing to do for it
    assert ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY) == ""
    assert steering.next() is Event.TAKE_ARM
    assert "Step one" in ask(steering, Event.TAKE_ARM, Mode.EXO_ONLY)
